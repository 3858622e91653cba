"""Choice of the logs that are downloaded, and the names of their files."""

import pytest

from darko_gcs.errors import GroundError
from darko_gcs.tasks.log_download import choose_logs, file_name, save_log
from protocol.events import RemoteLog

LOGS = (RemoteLog(0, 1_790_000_000, 100), RemoteLog(1, 0, 200), RemoteLog(2, 0, 0))


@pytest.mark.parametrize(
    ("which", "numbers"), [(["last"], [2]), (["all"], [0, 1, 2]), (["1", "0"], [1, 0]), (["2", "last"], [2])]
)
def test_logs_are_chosen_by_number_or_by_word(which, numbers):
    assert [log.number for log in choose_logs(which, LOGS)] == numbers


@pytest.mark.parametrize(
    ("which", "logs", "words"), [(["7"], LOGS, "available: 0, 1, 2"), (["last"], (), "available: none")]
)
def test_a_missing_log_is_an_error_that_lists_the_available_ones(which, logs, words):
    with pytest.raises(GroundError, match=words):
        choose_logs(which, logs)


def test_file_names_have_the_number_and_the_date_if_it_is_known():
    assert [file_name(log) for log in LOGS[:2]] == ["vehicle-0000-20260921-141320.tlog", "vehicle-0001.tlog"]


def test_a_log_never_replaces_a_file(tmp_path):
    paths = [save_log(tmp_path / "new", LOGS[1], data) for data in (b"one", b"two")]
    assert [path.name for path in paths] == ["vehicle-0001.tlog", "vehicle-0001-2.tlog"]
    assert [path.read_bytes() for path in paths] == [b"one", b"two"]
    assert len(list((tmp_path / "new").iterdir())) == 2


def test_a_folder_that_cannot_be_written_is_an_error(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(GroundError, match="cannot be written"):
        save_log(tmp_path / "file", LOGS[1], b"data")
