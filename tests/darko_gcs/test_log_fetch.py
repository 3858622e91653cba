"""``darko-gcs log fetch``: which logs, under which names, and what is said."""

import json

import pytest

from darko_gcs.commands.log_fetch import _as_json, _as_text
from darko_gcs.errors import GroundError
from darko_gcs.log_transfer import Fetched, _choose, _save, file_name
from protocol.events import RemoteLog

LOGS = (RemoteLog(0, 1_790_000_000, 100), RemoteLog(1, 0, 200), RemoteLog(2, 0, 0))


@pytest.mark.parametrize(
    ("which", "numbers"), [(["last"], [2]), (["all"], [0, 1, 2]), (["1", "0"], [1, 0]), (["2", "last"], [2])]
)
def test_logs_are_chosen_by_number_or_by_word(which, numbers):
    assert [log.number for log in _choose(which, LOGS)] == numbers


@pytest.mark.parametrize(("which", "logs", "words"), [(["7"], LOGS, "there are 0, 1, 2"), (["last"], (), "none")])
def test_a_log_that_is_not_there_is_said_with_those_that_are(which, logs, words):
    with pytest.raises(GroundError, match=words):
        _choose(which, logs)


def test_names_tell_the_number_and_the_date_if_there_is_one():
    assert [file_name(log) for log in LOGS[:2]] == ["vehicle-0000-20260921-141320.tlog", "vehicle-0001.tlog"]


def test_a_log_never_replaces_a_file(tmp_path):
    paths = [_save(tmp_path / "new", LOGS[1], data) for data in (b"one", b"two")]
    assert [path.name for path in paths] == ["vehicle-0001.tlog", "vehicle-0001-2.tlog"]
    assert [path.read_bytes() for path in paths] == [b"one", b"two"]
    assert len(list((tmp_path / "new").iterdir())) == 2


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(GroundError, match="cannot be written"):
        _save(tmp_path / "file", LOGS[1], b"data")


def test_what_was_fetched_is_said_to_people_and_programs(tmp_path):
    listed = Fetched(LOGS, {})
    assert _as_text(listed).splitlines()[0] == "log 0: 100 bytes, 2026-09-21 14:13:20 UTC"
    assert _as_text(Fetched((), {})) == "the vehicle has no logs"
    fetched = Fetched(LOGS, {1: tmp_path / "a.tlog"})
    assert _as_text(fetched) == f"log 1 -> {tmp_path / 'a.tlog'}"
    told = json.loads(_as_json(fetched))["logs"]
    assert told[1] == {"number": 1, "began": None, "bytes": 200, "file": str(tmp_path / "a.tlog")}
    assert told[0]["file"] is None
