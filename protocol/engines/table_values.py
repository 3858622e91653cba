"""Tables on the wire: a parameter and its value, and the entries of a flight plan with the checksum of them all.

PARAM_VALUE carries 32 bits in a float field. PX4 and MAVSDK store the bytes of an integer there unchanged; ArduPilot
stores the float of the same value (a C cast).
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError, WireRangeError
from protocol.names import MAX_NAME_LENGTH
from protocol.wire.message import Message

_REAL32 = mavlink.MAV_PARAM_TYPE_REAL32
_FORMATS = {
    mavlink.MAV_PARAM_TYPE_UINT8: "<B3x",
    mavlink.MAV_PARAM_TYPE_INT8: "<b3x",
    mavlink.MAV_PARAM_TYPE_UINT16: "<H2x",
    mavlink.MAV_PARAM_TYPE_INT16: "<h2x",
    mavlink.MAV_PARAM_TYPE_UINT32: "<I",
    mavlink.MAV_PARAM_TYPE_INT32: "<i",
    _REAL32: "<f",
}


_BYTEWISE = mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
_C_CAST = mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST


class ValueEncoding(StrEnum):
    """Encoding of an integer in the float field of PARAM_VALUE and PARAM_SET."""

    BYTEWISE = "bytewise"
    C_CAST = "C cast"


_BY_AUTOPILOT = {
    mavlink.MAV_AUTOPILOT_PX4: ValueEncoding.BYTEWISE,
    mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: ValueEncoding.C_CAST,
}
_BY_CAPABILITY = {_BYTEWISE: ValueEncoding.BYTEWISE, _C_CAST: ValueEncoding.C_CAST}


def value_encoding(autopilot: int, capabilities: int = 0) -> ValueEncoding | None:
    """The encoding of a vehicle; None if neither its capabilities nor its autopilot tell it.

    Args:
        autopilot: MAV_AUTOPILOT.
        capabilities: MAV_PROTOCOL_CAPABILITY of its AUTOPILOT_VERSION; one of the two bits of the parameter protocol
            decides.
    """
    return _BY_CAPABILITY.get(capabilities & (_BYTEWISE | _C_CAST)) or _BY_AUTOPILOT.get(autopilot)


def encode_value(value: float, kind: int, encoding: ValueEncoding | None = None) -> float:
    """PARAM_VALUE.param_value for a value of MAV_PARAM_TYPE ``kind``; bytewise where no encoding is known.

    Raises:
        LocalProtocolError: The value does not fit the type, or the type is not encoded in 32 bits.
    """
    try:
        layout = _FORMATS[kind]
        data = struct.pack(layout, value if kind == _REAL32 or value != int(value) else int(value))
    except (KeyError, struct.error, OverflowError, ValueError) as error:
        raise WireRangeError(f"{value} is not a value of MAV_PARAM_TYPE {kind}") from error
    if encoding is ValueEncoding.C_CAST and kind != _REAL32:
        return _as_float(int(value))
    (carried,) = struct.unpack("<f", data)
    if struct.pack("<f", carried) != data:  # a float register changes the bits of a signalling NaN
        raise LocalProtocolError(f"{value} cannot be sent as the bytes of a float")
    return float(carried)


def _as_float(value: int) -> float:
    (carried,) = struct.unpack("<f", struct.pack("<f", value))
    if carried != value:
        raise LocalProtocolError(f"{value} cannot be sent: the vehicle takes integers as floats, which have 24 bits")
    return float(carried)


def decode_value(param_value: float, kind: int, encoding: ValueEncoding | None = None) -> float:
    """The value in PARAM_VALUE.param_value; for an unknown type, the float itself."""
    if encoding is ValueEncoding.C_CAST:
        return float(param_value)
    layout = _FORMATS.get(kind, "<f")
    (value,) = struct.unpack(layout, struct.pack("<f", param_value))
    return float(value) if layout == "<f" else int(value)


class ParameterRangeError(LocalProtocolError):
    """A parameter cannot have a value.

    Attributes:
        flaw: Why, without its name.
    """

    def __init__(self, name: str, flaw: str) -> None:
        super().__init__(f"parameter {name}: {flaw}")
        self.flaw = flaw


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One row of the vehicle's parameter table: it has no value outside its range.

    Raises:
        LocalProtocolError: The name does not fit the wire, or the value is outside its range (ParameterRangeError).
    """

    name: str
    type: int  # MAV_PARAM_TYPE, at most 32 bits wide
    value: float
    minimum: float = -math.inf
    maximum: float = math.inf
    unit: str = ""
    description: str = ""

    def __post_init__(self) -> None:
        if not (self.name.isascii() and self.name.isprintable() and 1 <= len(self.name) <= MAX_NAME_LENGTH):
            raise LocalProtocolError(f"parameter name {self.name!r} is not 1 to {MAX_NAME_LENGTH} ASCII characters")
        if flaw := self.flaw(self.value):
            raise ParameterRangeError(self.name, flaw)
        encode_value(self.value, self.type)

    def flaw(self, value: float) -> str:
        """Reason why the parameter cannot have a value; empty if it can."""
        if not math.isfinite(value):
            return f"{value} is not a finite number"
        if not self.minimum <= value <= self.maximum:
            return f"{value:g} is outside {self.minimum:g}..{self.maximum:g}"
        return ""


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
