"""Files on the wire: the payload and checksum of MAVLink FTP, and the stores that file and log servers read.

https://mavlink.io/en/services/ftp.html
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from typing import NamedTuple, Protocol, Self

from protocol.dialect import mavlink
from protocol.wire.message import Message

MAX_DATA = 239  # bytes of data in one message
_HEAD = struct.Struct("<HBBBBBxI")
_PAYLOAD_SIZE = _HEAD.size + MAX_DATA


class FtpPacket(NamedTuple):
    """The payload of a FILE_TRANSFER_PROTOCOL message."""

    seq: int
    session: int
    opcode: int  # MAV_FTP_OPCODE
    size: int = 0  # valid bytes of data, or bytes requested
    req_opcode: int = 0
    burst_complete: int = 0
    offset: int = 0
    data: bytes = b""

    @classmethod
    def of(cls, message: Message) -> Self:
        """The payload of a decoded message, with all ``MAX_DATA`` bytes of data whatever ``size`` is."""
        payload = bytes(message.payload)
        seq, session, opcode, size, req_opcode, burst_complete, offset = _HEAD.unpack_from(payload)
        return cls(
            seq=seq,
            session=session,
            opcode=opcode,
            size=size,
            req_opcode=req_opcode,
            burst_complete=burst_complete,
            offset=offset,
            data=payload[_HEAD.size : _PAYLOAD_SIZE],
        )

    @property
    def content(self) -> bytes:
        """The valid bytes of data."""
        return self.data[: self.size]

    @property
    def path(self) -> str:
        """The path in the data, up to its first zero; bytes outside ASCII become U+FFFD, which no file name has."""
        return self.content.split(b"\0")[0].decode("ascii", errors="replace")

    @property
    def error(self) -> int:
        """MAV_FTP_ERR of a NAK."""
        return self.data[0] if self.size else int(mavlink.MAV_FTP_ERR_FAIL)

    def to_message(self, system: int, component: int) -> Message:
        """The message that carries the packet to a component."""
        payload = _HEAD.pack(*self[:7]) + self.data.ljust(MAX_DATA, b"\0")
        return mavlink.MAVLink_file_transfer_protocol_message(0, system, component, list(payload))


def crc32(data: bytes, crc: int = 0) -> int:
    """The checksum of MAVLink FTP and of component metadata: CRC-32's polynomial, started at 0 and not inverted.

    Args:
        data: A file, or the next part of it.
        crc: The checksum of the parts before.
    """
    return zlib.crc32(data, crc ^ 0xFFFFFFFF) ^ 0xFFFFFFFF


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
