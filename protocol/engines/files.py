"""What the vehicle's file engines need of a store: names, sizes, and bytes at an offset."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

__all__ = ["BytesFile", "Entry", "File", "FileTree", "Log", "LogStore", "NoFiles"]


class File(Protocol):
    """An open file; what it holds up to ``size`` does not change while it is open."""

    @property
    def size(self) -> int:
        """Bytes."""

    def read(self, offset: int, size: int) -> bytes:
        """Bytes from an offset on, fewer at the end.

        Raises:
            OSError: They cannot be read.
        """

    def close(self) -> None:
        """Give it back."""


class Entry(NamedTuple):
    """One line of a folder."""

    name: str
    size: int | None  # None: a folder itself


class FileTree(Protocol):
    """Folders and files by path; both calls raise OSError, FileNotFoundError when there is nothing there."""

    def entries(self, path: str) -> Sequence[Entry]:
        """What a folder holds; the order is the same on every call."""

    def open(self, path: str) -> File:
        """A file, to be read."""


class Log(NamedTuple):
    """A recorded flight."""

    name: str
    time_utc: int  # when it began, since 1970 [s]; 0: not known
    size: int


class LogStore(Protocol):
    """Recorded flights."""

    def logs(self) -> Sequence[Log]:
        """All of them, oldest first."""

    def open(self, name: str) -> File:
        """One of them, to be read. Raises OSError."""


class BytesFile:
    """A file that is made when it is asked for."""

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
        """Nothing to give back."""


class NoFiles:
    """Nothing at all: a tree without files, a store without logs."""

    def entries(self, path: str) -> Sequence[Entry]:
        """An empty root."""
        if path.strip("/"):
            raise FileNotFoundError(path)
        return ()

    def open(self, path: str) -> File:
        """There is no such file."""
        raise FileNotFoundError(path)

    def logs(self) -> Sequence[Log]:
        """None."""
        return ()
