"""Target systems of a datagram, read from its bytes without decoding its messages."""

from __future__ import annotations

import struct
from functools import cache

from protocol.dialect import mavlink
from protocol.wire.framing import MAGIC_V1, message_id, split_frames

__all__ = ["EVERYONE", "target_systems"]

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
    return frame[(6 if frame[0] == MAGIC_V1 else 10) + place]


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
