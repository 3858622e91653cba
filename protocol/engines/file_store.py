"""Interface between the file and log servers and a store: names, sizes, and bytes at an offset."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

__all__ = ["BytesFile", "Entry", "File", "FileTree", "Log", "LogStore", "NoFiles"]


class File(Protocol):
    """An open file; its content up to ``size`` does not change while it is open."""

    @property
    def size(self) -> int:
        """Bytes."""

    def read(self, offset: int, size: int) -> bytes:
        """Bytes from an offset on, fewer at the end.

        Raises:
            OSError: They cannot be read.
        """

    def close(self) -> None:
        """Release it."""


class Entry(NamedTuple):
    """One entry of a folder."""

    name: str
    size: int | None  # None: a subfolder


class FileTree(Protocol):
    """Folders and files by path. Both calls raise OSError, FileNotFoundError if the path does not exist."""

    def entries(self, path: str) -> Sequence[Entry]:
        """The entries of a folder, in the same order on every call."""

    def open(self, path: str) -> File:
        """Open a file for reading."""


class Log(NamedTuple):
    """A recorded flight."""

    name: str
    time_utc: int  # when it began, since 1970 [s]; 0: unknown
    size: int


class LogStore(Protocol):
    """Recorded flights."""

    def logs(self) -> Sequence[Log]:
        """All logs, oldest first."""

    def open(self, name: str) -> File:
        """Open a log for reading.

        Raises:
            OSError: It cannot be opened.
        """


class BytesFile:
    """A file in memory."""

    def __init__(self, data: bytes) -> None:
        self._data = data

    @property
    def size(self) -> int:
        """Bytes."""
        return len(self._data)

    def read(self, offset: int, size: int) -> bytes:
        """Bytes from an offset on, fewer at the end."""
        return self._data[offset : offset + size]

    def close(self) -> None:
        """There is nothing to release."""


class NoFiles:
    """An empty store: a tree without files and without logs."""

    def entries(self, path: str) -> Sequence[Entry]:
        """An empty root."""
        if path.strip("/"):
            raise FileNotFoundError(path)
        return ()

    def open(self, path: str) -> File:
        """Always fails.

        Raises:
            FileNotFoundError: There is no such file.
        """
        raise FileNotFoundError(path)

    def logs(self) -> Sequence[Log]:
        """An empty list."""
        return ()
