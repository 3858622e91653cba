"""One process a state folder."""

import argparse
import subprocess
import sys

import pytest

from sitl.commands.run import parser
from sitl.process import vehicle_process
from sitl.process.fleet_process import member_arguments
from sitl.process.vehicle_process import state_folder, with_locked_folder
from sitl.tools.folder_lock import BusyFolderError, FolderLock, lock_free_folder
from sitl.tools.persistence import StateFolder, StateFolderError

HOLDS = """
import sys
from pathlib import Path
from sitl.tools.folder_lock import FolderLock
lock = FolderLock(Path(sys.argv[1]))
print("holds", flush=True)
sys.stdin.read()
"""


def holder(folder):
    """Another process that holds a folder."""
    pipe = subprocess.PIPE
    process = subprocess.Popen([sys.executable, "-c", HOLDS, str(folder)], stdin=pipe, stdout=pipe)
    assert process.stdout.readline() == b"holds\n"
    return process


@pytest.fixture
def arguments(tmp_path, monkeypatch):
    monkeypatch.setattr(vehicle_process, "user_data_path", lambda _name: tmp_path)

    def make(**given):
        return argparse.Namespace(**{"state_dir": None, "sysid": 1, "vehicles": 1} | given)

    return make


def test_a_second_process_is_told_who_has_the_folder_and_one_that_was_killed_has_nothing(tmp_path):
    folder = tmp_path / "state"
    process = holder(folder)
    with pytest.raises(BusyFolderError, match=f"process {process.pid} keeps its vehicle there: .*--state-dir"):
        FolderLock(folder)
    process.kill()
    process.communicate()
    assert (folder / "lock").read_text() == f"{process.pid}\n"  # its file stays
    FolderLock(folder).close()


def test_a_folder_is_free_again_once_it_is_closed(tmp_path):
    for _ in range(2):
        FolderLock(tmp_path).close()
    lock = FolderLock(tmp_path)
    with pytest.raises(BusyFolderError):
        FolderLock(tmp_path)
    lock.close()


def test_beside_a_busy_folder_the_next_free_one_is_taken_and_named(tmp_path):
    locks = [lock_free_folder(tmp_path / "sitl") for _ in range(3)]
    assert [lock.folder.name for lock, _ in locks] == ["sitl", "sitl-2", "sitl-3"]
    assert locks[0][1] == ""
    assert f"keeps parameters and plans in {tmp_path / 'sitl-2'}" in locks[1][1]
    for lock, _ in locks:
        lock.close()


def test_a_folder_that_cannot_be_made_is_an_error_and_no_other_is_tried(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StateFolderError) as told:
        lock_free_folder(tmp_path / "file")
    assert not isinstance(told.value, BusyFolderError)


def test_each_system_id_has_a_folder_of_its_own_and_the_first_keeps_its_place(arguments, tmp_path):
    assert state_folder(arguments()) == tmp_path / "sitl"
    assert state_folder(arguments(sysid=2)) == tmp_path / "sitl" / "vehicle-2"
    assert state_folder(arguments(sysid=2, state_dir=tmp_path / "x")) == tmp_path / "x"
    assert state_folder(arguments(sysid=2, vehicles=3)) == tmp_path / "sitl"  # which has theirs


def test_two_processes_of_one_id_do_not_share_what_they_keep(arguments, capsys):
    (first, one), (second, other) = (with_locked_folder(arguments()) for _ in range(2))
    StateFolder(state_folder(first)).save_parameters({"DRK_PACE": 1.0})
    assert StateFolder(state_folder(second)).parameters() == {}
    assert "warning" in capsys.readouterr().err
    one.close()
    other.close()


def test_a_folder_that_was_asked_for_is_not_replaced(arguments, tmp_path):
    given = arguments(state_dir=tmp_path / "mine")
    _, lock = with_locked_folder(given)
    with pytest.raises(BusyFolderError):
        with_locked_folder(given)
    lock.close()


def test_a_fleets_folders_are_those_of_single_vehicles(arguments, tmp_path):
    fleet = parser({}).parse_args(["--vehicles", "2", "--sysid", "2"])
    members = member_arguments(fleet, state_folder(fleet))
    assert members[0].state_dir == state_folder(arguments(sysid=2))
