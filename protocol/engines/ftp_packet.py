"""The payload of a FILE_TRANSFER_PROTOCOL message and the checksum of MAVLink FTP.

https://mavlink.io/en/services/ftp.html
"""

from __future__ import annotations

import struct
import zlib
from typing import NamedTuple, Self

from protocol.dialect import mavlink
from protocol.wire.message import Message

__all__ = ["MAX_DATA", "FtpPacket", "crc32"]

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
