"""Messages of the dialect to frames and back (https://mavlink.io/en/guide/serialization.html).

Byte for byte what pymavlink makes, and read as pymavlink reads it, in a third of the time.
"""

from __future__ import annotations

from struct import Struct

from fastcrc.crc16 import mcrf4xx

from protocol.dialect.dialect_message import DialectMessage
from protocol.wire.framing import HEADER_V1, HEADER_V2, MAGIC_V2

_pack_header = Struct("<BBxxBBBHB").pack  # of version 2; its flags are zero
_pack_checksum = Struct("<H").pack
# Begun with this, a checksum that takes the first byte in is that of the bytes behind it: the frame is not copied.
_BEFORE_MAGIC = next(crc for crc in range(1 << 16) if mcrf4xx(bytes((MAGIC_V2,)), crc) == 0xFFFF)
_new = object.__new__


def checksum(data: bytes, extra: int) -> int:
    """CRC-16/MCRF4XX of a frame from behind its first byte up to its checksum, and of its message's CRC_EXTRA."""
    return int(mcrf4xx(data + bytes((extra,))))


def make_frame(message: DialectMessage, system: int, component: int, sequence: int) -> bytes:
    """An unsigned frame of version 2.

    Raises:
        struct.error, TypeError, OverflowError, AttributeError, IndexError: A field does not fit its type.
    """
    payload = message.pack_fields().rstrip(b"\0") or b"\0"
    low, high, extra, _ = message.WIRE
    frame = _pack_header(MAGIC_V2, len(payload), sequence, system, component, low, high) + payload
    return frame + _pack_checksum(mcrf4xx(frame + extra, _BEFORE_MAGIC))


def read_frame(kind: type[DialectMessage], frame: bytes) -> DialectMessage | None:
    """The message of a whole frame, of either version; None if its checksum is wrong.

    Args:
        kind: The class of the frame's message id.
        frame: Its bytes, a signature included.
    """
    at = HEADER_V2 if frame[0] == MAGIC_V2 else HEADER_V1
    return read_payload(kind, frame, at, at + frame[1])


def read_payload(kind: type[DialectMessage], frame: bytes, at: int, end: int) -> DialectMessage | None:
    """As ``read_frame``, for a caller that knows where the payload begins and ends."""
    _, _, extra, size = kind.WIRE
    if mcrf4xx(frame[1:end] + extra) != frame[end] | frame[end + 1] << 8:
        return None
    message = _new(kind)
    message._msgbuf = frame  # noqa: SLF001 - what get_msgbuf() returns
    if end - at < size:  # zeros at its end, or extensions, were left out
        message.unpack_fields(frame[at:end].ljust(size, b"\0"), 0)
    else:
        message.unpack_fields(frame, at)
    return message
