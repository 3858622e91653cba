"""The table of a flight plan on the wire: what can change in it, and the checksum by which both ends compare it."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping

from protocol.wire.message import Message

MAX_ENTRIES = 2000  # of one table; a vehicle that claims more is not asked
PIECE_BYTES = 180  # of a file of a plan in one DARKO_PLAN_FILE
EVENTS_KEPT = 32  # by the vehicle; older ones cannot be asked for again
TABLE_MESSAGES = frozenset({"DARKO_PLAN_BLOCK", "DARKO_PLAN_WAYPOINT", "DARKO_PLAN_VARIABLE", "DARKO_PLAN_SECTOR"})


def changing_part(entry: Message) -> bytes:
    """The fields of an entry that can change while its plan is loaded, packed; empty for blocks and sectors."""
    if entry.get_type() == "DARKO_PLAN_WAYPOINT":
        place = (entry.lat, entry.lon, entry.alt, entry.x, entry.y, entry.z)
        return struct.pack("<Hii4f", entry.entry, *place)
    if entry.get_type() == "DARKO_PLAN_VARIABLE":
        return struct.pack("<Hf", entry.entry, entry.value)
    return b""


def table_checksum(entries: Mapping[int, Message]) -> int:
    """CRC-32 of all that can change, in the order of the table."""
    crc = 0
    for number in sorted(entries):
        crc = zlib.crc32(changing_part(entries[number]), crc)
    return crc


def plan_key(plan_id: int) -> float:
    """The part of a plan's id that fits a command's parameter."""
    return float(plan_id & 0xFFFF)
