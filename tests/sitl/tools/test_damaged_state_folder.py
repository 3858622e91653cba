"""A damaged state folder: the error names the file."""

import pytest

from protocol.frames import Geodetic
from sitl.mavlink.signing_keys import KeyFile
from sitl.tools.persistence import MAX_TABLE_SIZE, HomeAndOrigin, StateFolder, StateFolderError

DEEP, LONG_NUMBER = "[" * 100_000, "1" * 400


@pytest.mark.parametrize("content", [DEEP, f'{{"A": {LONG_NUMBER}}}', '{"A": 1e400}', " " * (MAX_TABLE_SIZE + 1)])
def test_damaged_parameters_are_reported_with_the_file(tmp_path, content):
    (tmp_path / "parameters.json").write_text(content)
    with pytest.raises(StateFolderError, match=r"parameters\.json: "):
        StateFolder(tmp_path).parameters()


def test_a_damaged_home_is_reported_with_the_file(tmp_path):
    (tmp_path / "home.json").write_text(DEEP)
    with pytest.raises(StateFolderError, match=r"home\.json: "):
        StateFolder(tmp_path).home_and_origin()


def test_a_place_with_too_many_digits_is_refused(tmp_path):
    state_folder = StateFolder(tmp_path)
    state_folder.save_home_and_origin(HomeAndOrigin(*[Geodetic(1.0, 2.0, int(LONG_NUMBER))] * 3))
    with pytest.raises(StateFolderError, match="not a place"):
        state_folder.home_and_origin()


def test_damaged_keys_are_reported_with_the_file(tmp_path):
    (tmp_path / "signing.json").write_text(DEEP)
    with pytest.raises(StateFolderError, match=r"signing\.json: "):
        KeyFile(tmp_path).load()


def test_a_damaged_list_of_plans_to_clear_clears_nothing(tmp_path):
    (tmp_path / "clearing").write_bytes(b"\xff\xfemission.plan")
    (tmp_path / "mission.plan").write_text("a plan")
    StateFolder(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mission.plan"]


@pytest.mark.parametrize(
    ("name", "read"), [("parameters.json", StateFolder.parameters), ("mission.plan", StateFolder.mission)]
)
def test_an_endless_file_is_too_long(tmp_path, name, read):
    state_folder = StateFolder(tmp_path)
    (tmp_path / name).symlink_to("/dev/zero")
    with pytest.raises(StateFolderError, match=f"{name}: too long"):
        read(state_folder)
