"""One process a state folder: a lock that the system lets go with the process, however it ends."""

from __future__ import annotations

import os
from pathlib import Path

from sitl.tools.persistence import StateFolder, StateFolderError

try:
    import fcntl
except ImportError:  # pragma: no cover - there no process is told of another one
    fcntl = None  # type: ignore[assignment]

LOCK_NAME = "lock"  # of the file in the folder; it names the process
MAX_FOLDERS = 100  # that are tried beside a busy one


class BusyFolderError(StateFolderError):
    """Another process holds the folder."""


class FolderLock:
    """Holds a folder until it is closed or the process ends.

    Args:
        folder: Is made if it is missing.

    Raises:
        BusyFolderError: Another process holds it.
        StateFolderError: It cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = StateFolder(folder).folder
        try:
            self._file = os.open(self.folder / LOCK_NAME, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise StateFolderError(f"state folder {folder}: {error.strerror}") from error
        try:
            if fcntl is not None:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            holder = os.read(self._file, 32).decode(errors="replace").strip()
            os.close(self._file)
            raise BusyFolderError(
                f"state folder {folder}: process {holder or 'unknown'} keeps its vehicle there: "
                "give this one another --state-dir"
            ) from None
        os.truncate(self._file, 0)
        os.pwrite(self._file, f"{os.getpid()}\n".encode(), 0)

    def close(self) -> None:
        """Let the folder go."""
        os.close(self._file)


def lock_free_folder(folder: Path) -> tuple[FolderLock, str]:
    """The lock of a folder, or of the first free one beside it; and what to tell the pilot of that, or nothing.

    Raises:
        StateFolderError: None can be written, or none of many is free.
    """
    try:
        return FolderLock(folder), ""
    except BusyFolderError as error:
        busy = error
    for number in range(2, MAX_FOLDERS):
        beside = folder.with_name(f"{folder.name}-{number}")
        try:
            lock = FolderLock(beside)
        except BusyFolderError:
            continue
        return lock, f"warning: {folder} is another running vehicle's: this one keeps parameters and plans in {beside}"
    raise busy
