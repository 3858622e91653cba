"""A parameter and its value on the wire (https://mavlink.io/en/services/parameter.html, bytewise encoding).

PARAM_VALUE carries 32 bits in a float field. PX4 and MAVSDK put the bytes of an integer there as they are.
"""

import math
import struct
from dataclasses import dataclass

from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError

__all__ = ["Parameter", "decode_value", "encode_value", "type_name"]

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


def encode_value(value: float, kind: int) -> float:
    """PARAM_VALUE.param_value of a value of MAV_PARAM_TYPE ``kind``.

    Raises:
        LocalProtocolError: The type has no room for the value, or no 32-bit form at all.
    """
    try:
        layout = _FORMATS[kind]
        data = struct.pack(layout, value if kind == _REAL32 or value != int(value) else int(value))
    except (KeyError, struct.error, OverflowError, ValueError) as error:
        raise LocalProtocolError(f"{value} is no value of MAV_PARAM_TYPE {kind}") from error
    (carried,) = struct.unpack("<f", data)
    if struct.pack("<f", carried) != data:  # the bits of a signalling NaN do not survive a float register
        raise LocalProtocolError(f"{value} cannot travel as the bytes of a float")
    return float(carried)


def decode_value(param_value: float, kind: int) -> float:
    """The value that PARAM_VALUE.param_value carries; of an unknown type, the float itself."""
    layout = _FORMATS.get(kind, "<f")
    (value,) = struct.unpack(layout, struct.pack("<f", param_value))
    return float(value) if layout == "<f" else int(value)


def type_name(kind: int) -> str:
    """A MAV_PARAM_TYPE in short."""
    entry = mavlink.enums["MAV_PARAM_TYPE"].get(kind)
    return str(entry.name).removeprefix("MAV_PARAM_TYPE_") if entry else f"type {kind}"


@dataclass(frozen=True, slots=True)
class Parameter:
    """One row of the vehicle's parameter table.

    Raises:
        LocalProtocolError: The name does not fit the wire, or the value is out of its own range.
    """

    name: str
    type: int  # MAV_PARAM_TYPE, at most 32 bits wide
    value: float
    minimum: float = -math.inf
    maximum: float = math.inf
    unit: str = ""
    description: str = ""

    def __post_init__(self) -> None:
        if not (self.name.isascii() and self.name.isprintable() and 1 <= len(self.name) <= 16):
            raise LocalProtocolError(f"parameter name {self.name!r} is not 1 to 16 ASCII characters")
        if flaw := self.flaw(self.value):
            raise LocalProtocolError(f"parameter {self.name}: {flaw}")
        encode_value(self.value, self.type)

    def flaw(self, value: float) -> str:
        """Why the parameter cannot take a value; empty when it can."""
        if not math.isfinite(value):
            return f"{value} is not a finite number"
        if not self.minimum <= value <= self.maximum:
            return f"{value:g} is outside {self.minimum:g}..{self.maximum:g}"
        return ""
