"""A file is replaced completely or not at all."""

import os
import stat

import pytest

from protocol.errors import FileError
from protocol.tools.files import write_atomically


def test_a_file_is_written_and_replaced(tmp_path):
    path = tmp_path / "plan"
    for data in (b"old", b"a longer new one", b""):
        write_atomically(path, data)
        assert path.read_bytes() == data
        assert list(tmp_path.iterdir()) == [path]


def test_a_secret_file_is_never_readable_by_others(tmp_path):
    path = tmp_path / "key"
    (tmp_path / ".key.new").write_bytes(b"left by a crash")  # with the usual permissions
    write_atomically(path, b"secret", mode=0o600)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_failed_write_keeps_the_old_file_and_leaves_nothing_behind(tmp_path, monkeypatch):
    path = tmp_path / "plan"
    path.write_bytes(b"old")

    def full(_descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FileError, match="plan: cannot be written: No space left on device"):
        write_atomically(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_missing_folder_is_a_file_error(tmp_path):
    with pytest.raises(FileError, match="cannot be written"):
        write_atomically(tmp_path / "none" / "plan", b"")
