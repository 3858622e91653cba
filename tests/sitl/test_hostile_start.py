"""What is damaged in the state folder, and what cannot be on the command line: one line that says what and where."""

import pytest

from protocol.frames import Geodetic
from sitl.__main__ import main
from sitl.memory import LARGEST, Anchors, Memory, MemoryFaultError
from sitl.wire.keys import KeyFile

DEEP, LONG_NUMBER = "[" * 100_000, "1" * 400


@pytest.mark.parametrize("content", [DEEP, f'{{"A": {LONG_NUMBER}}}', '{"A": 1e400}', " " * (LARGEST + 1)])
def test_parameters_that_are_none_are_said_by_file(tmp_path, content):
    (tmp_path / "parameters.json").write_text(content)
    with pytest.raises(MemoryFaultError, match=r"parameters\.json: "):
        Memory(tmp_path).parameters()


def test_a_home_that_is_none_is_said_by_file(tmp_path):
    (tmp_path / "home.json").write_text(DEEP)
    with pytest.raises(MemoryFaultError, match=r"home\.json: "):
        Memory(tmp_path).anchors()


def test_a_place_of_too_many_digits_is_none(tmp_path):
    memory = Memory(tmp_path)
    memory.keep_anchors(Anchors(*[Geodetic(1.0, 2.0, int(LONG_NUMBER))] * 3))
    with pytest.raises(MemoryFaultError, match="not a place"):
        memory.anchors()


def test_keys_that_are_none_are_said_by_file(tmp_path):
    (tmp_path / "signing.json").write_text(DEEP)
    with pytest.raises(MemoryFaultError, match=r"signing\.json: "):
        KeyFile(tmp_path).load()


def test_a_list_of_plans_to_be_cleared_that_is_no_text_clears_none(tmp_path):
    (tmp_path / "clearing").write_bytes(b"\xff\xfemission.plan")
    (tmp_path / "mission.plan").write_text("kept")
    Memory(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mission.plan"]


@pytest.mark.parametrize(
    ("option", "value", "reason"),
    [
        ("--seed", "-1", "-1 is negative"),
        ("--home", "0,0,1e308", "altitude within ±10000 m"),
        ("--start", "0,0,5,1e300", "YAW within ±360"),
    ],
)
def test_a_number_that_cannot_be_is_refused_by_name(capsys, option, value, reason):
    with pytest.raises(SystemExit):
        main(["run", option, value])
    assert f"argument {option}: " in (error := capsys.readouterr().err)
    assert reason in error


@pytest.mark.parametrize(
    ("option", "value", "reason"),
    [
        ("--start", "1e308,0,5,0", "--start: 1"),
        ("--start", "0,0,1e5,0", "--start: altitude 100000.0 m is outside the arena"),
        ("--airframe", "a" * 5000, "no parameter set 'aaa"),
    ],
)
def test_where_it_cannot_begin_is_one_line(tmp_path, capsys, option, value, reason):
    code = main(["run", "--port", "0", "--state-dir", str(tmp_path), "--quiet", option, value])
    error = capsys.readouterr().err
    assert (code, error.count("\n")) == (2, 1)
    assert reason in error


@pytest.mark.parametrize(("name", "read"), [("parameters.json", Memory.parameters), ("mission.plan", Memory.mission)])
def test_a_file_without_an_end_is_too_long(tmp_path, name, read):
    memory = Memory(tmp_path)
    (tmp_path / name).symlink_to("/dev/zero")
    with pytest.raises(MemoryFaultError, match=f"{name}: too long"):
        read(memory)
