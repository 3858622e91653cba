"""What both ends of MAVLink FTP share: the payload, its numbers and its checksum.

https://mavlink.io/en/services/ftp.html
"""

import struct
import zlib
from typing import NamedTuple, Self

from protocol.codec import Message
from protocol.dialect import mavlink

__all__ = ["DATA", "Packet", "crc32"]

DATA = 239  # bytes of data one message carries [B]
_HEAD = struct.Struct("<HBBBBBxI")
_PAYLOAD = _HEAD.size + DATA


class Packet(NamedTuple):
    """The payload of a FILE_TRANSFER_PROTOCOL message."""

    seq: int
    session: int
    opcode: int  # MAV_FTP_OPCODE
    size: int = 0  # bytes of data that count, or bytes asked for
    req_opcode: int = 0
    burst_complete: int = 0
    offset: int = 0
    data: bytes = b""

    @classmethod
    def of(cls, message: Message) -> Self:
        """What a decoded message carries; all ``DATA`` bytes, whatever ``size`` says."""
        payload = bytes(message.payload)
        seq, session, opcode, size, req_opcode, complete, offset = _HEAD.unpack_from(payload)
        return cls(seq, session, opcode, size, req_opcode, complete, offset, payload[_HEAD.size : _PAYLOAD])

    @property
    def content(self) -> bytes:
        """The bytes of data that count."""
        return self.data[: self.size]

    @property
    def path(self) -> str:
        """The path in the data, up to its first zero; unreadable bytes become signs that no file's name has."""
        return self.content.split(b"\0")[0].decode("ascii", errors="replace")

    @property
    def error(self) -> int:
        """MAV_FTP_ERR of a refusal."""
        return self.data[0] if self.size else int(mavlink.MAV_FTP_ERR_FAIL)

    def to_message(self, system: int, component: int) -> Message:
        """The message that carries it to a component."""
        payload = _HEAD.pack(*self[:7]) + self.data.ljust(DATA, b"\0")
        return mavlink.MAVLink_file_transfer_protocol_message(0, system, component, list(payload))


def crc32(data: bytes, crc: int = 0) -> int:
    """The checksum of MAVLink FTP and of component metadata: CRC-32's polynomial, begun at 0 and not inverted.

    A longer file is done piece by piece: ``crc`` is the checksum of what came before.
    """
    return zlib.crc32(data, crc ^ 0xFFFFFFFF) ^ 0xFFFFFFFF
