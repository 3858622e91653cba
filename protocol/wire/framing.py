"""Boundaries of MAVLink frames by their length alone (https://mavlink.io/en/guide/serialization.html).

| Version | Header | Payload | Checksum | Signature |
|---|---|---|---|---|
| 1 | 6 bytes, the first 0xFE | n | 2 | never |
| 2 | 10 bytes, the first 0xFD | n | 2 | 13 bytes if bit 0 of the incompatibility flags (byte 2) is set |

n is byte 1 of either header. The codec, the telemetry logs and the signatures share this rule.
"""

from __future__ import annotations

import struct
from functools import cache

from protocol.dialect import mavlink

MAGIC_V1, MAGIC_V2 = 0xFE, 0xFD  # first byte of a frame, by version
HEADER_V1, HEADER_V2 = 6, 10  # [bytes]
CHECKSUM_SIZE = 2  # [bytes]
OVERHEAD_V1 = HEADER_V1 + CHECKSUM_SIZE  # header and checksum [bytes]
OVERHEAD_V2 = HEADER_V2 + CHECKSUM_SIZE
SIGNED_FLAG = 0x01  # the only incompatibility flag that is understood
SIGNATURE_SIZE = 13  # [bytes]


def frame_length(data: bytes | bytearray, at: int = 0) -> int:
    """Length [bytes] of the whole frame that starts at index ``at``; 0 if none does."""
    left = len(data) - at
    if left >= OVERHEAD_V2 and data[at] == MAGIC_V2:
        length = OVERHEAD_V2 + data[at + 1] + (SIGNATURE_SIZE if data[at + 2] & SIGNED_FLAG else 0)
    elif left >= OVERHEAD_V1 and data[at] == MAGIC_V1:
        length = OVERHEAD_V1 + data[at + 1]
    else:
        return 0
    return length if length <= left else 0


def message_id(frame: bytes | bytearray, at: int = 0) -> int:
    """Message id of the whole frame that starts at index ``at``."""
    return frame[at + 5] if frame[at] == MAGIC_V1 else int.from_bytes(frame[at + 7 : at + 10], "little")


class FrameBuffer:
    """Whole frames out of a stream of bytes; what is no frame is dropped."""

    def __init__(self) -> None:
        self._data = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Frames that are complete with these bytes."""
        self._data += data
        frames, at = [], 0
        while at < len(self._data):
            if self._data[at] not in {MAGIC_V1, MAGIC_V2}:
                at += 1
            elif length := frame_length(self._data, at):
                frames.append(bytes(self._data[at : at + length]))
                at += length
            else:
                break
        del self._data[:at]
        return frames


def split_frames(datagram: bytes) -> list[bytes]:
    """Whole frames at the beginning of a datagram; what follows them is left out."""
    frames, at = [], 0
    while length := frame_length(datagram, at):
        frames.append(datagram[at : at + length])
        at += length
    return frames


EVERYONE = 0
"""The target of a message that names no system, or system 0."""


def target_systems(datagram: bytes) -> frozenset[int]:
    """The systems that the frames of a datagram name; EVERYONE for a frame that names none or is not of the dialect.

    Checksums are left to whoever decodes. A datagram without a whole frame is for nobody.
    """
    return frozenset(_target(frame) for frame in split_frames(datagram))


def _target(frame: bytes) -> int:
    place = _target_place(message_id(frame))
    # MAVLink 2 leaves out zeros at a payload's end: https://mavlink.io/en/guide/serialization.html#payload_truncation
    if place is None or place >= frame[1]:
        return EVERYONE
    return frame[(HEADER_V1 if frame[0] == MAGIC_V1 else HEADER_V2) + place]


@cache
def _target_place(number: int) -> int | None:
    """Offset of the target system in a message's payload; None if it has none or is unknown."""
    kind = mavlink.mavlink_map.get(number)
    if kind is None:
        return None
    name = "target" if number == mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL else "target_system"
    if name not in kind.ordered_fieldnames:
        return None
    at = kind.ordered_fieldnames.index(name)
    types: str = kind.native_format.decode("ascii")[1 : at + 1]
    lengths: list[int] = kind.array_lengths[:at]
    return sum(struct.calcsize(f"<{field}") * max(count, 1) for field, count in zip(types, lengths, strict=True))
