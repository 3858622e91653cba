"""All wire scalings: SI units and degrees outside, scaled integers on the wire.

Rounding is to the nearest, ties to even. A value that does not fit its field is our bug and raises an error; it is
never clamped. Where the wire has a value for "unknown", NaN becomes that value.
"""

import math

from protocol.errors import LocalProtocolError, WireRangeError
from protocol.names import is_global_frame

UNKNOWN_INT32 = 0x7FFFFFFF  # x and y of COMMAND_INT and MISSION_ITEM_INT: "use the default"
NO_ITEM = 0xFFFF  # as the number of a mission item, or a count of them: not known
_UNKNOWN_UINT16 = 0xFFFF


def _scaled(value: float, scale: float, low: int, high: int, what: str) -> int:
    if not math.isfinite(value) or not low <= (scaled := round(value * scale)) <= high:
        raise WireRangeError(f"{what} {value} does not fit {low}..{high} at {scale:g} per unit")
    return scaled


def _int32(value: float, scale: float, what: str) -> int:
    return _scaled(value, scale, -(2**31), 2**31 - 1, what)


def to_e7(degrees: float) -> int:
    """Latitude or longitude [deg] as degE7."""
    return _int32(degrees, 1e7, "angle [deg]")


def from_e7(lat_or_lon_e7: int) -> float:
    """Latitude or longitude [deg] from degE7."""
    return lat_or_lon_e7 / 1e7


def local_e4(metres: float) -> int:
    """A local coordinate [m] as COMMAND_INT and MISSION_ITEM_INT carry it: 1e-4 m."""
    return _int32(metres, 1e4, "coordinate [m]")


def from_local_e4(x_or_y: int) -> float:
    """A local coordinate [m] from 1e-4 m."""
    return x_or_y / 1e4


def millimetres(metres: float) -> int:
    """A length [m] as int32 millimetres."""
    return _int32(metres, 1e3, "length [m]")


def from_millimetres(length: int) -> float:
    """A length [m] from millimetres."""
    return length / 1e3


def centimetres_per_second(speed: float) -> int:
    """A velocity component [m/s] as int16 cm/s."""
    return _scaled(speed, 1e2, -(2**15), 2**15 - 1, "speed [m/s]")


def centidegrees(heading: float) -> int:
    """A heading [rad] of any range as 0..35999 cdeg; NaN as 65535, unknown."""
    if math.isnan(heading):
        return _UNKNOWN_UINT16
    if math.isinf(heading):
        raise LocalProtocolError("heading is infinite")
    return round(math.degrees(heading) * 1e2) % 36000


def from_centidegrees(heading_cdeg: int) -> float:
    """A heading [rad] in [0, 2 pi) from cdeg; NaN from 65535."""
    return math.nan if heading_cdeg == _UNKNOWN_UINT16 else math.radians(heading_cdeg / 1e2)


def milliseconds(seconds: float) -> int:
    """A time [s] as uint32 ms, which wrap to 0 after 49.7 days."""
    return _scaled(seconds, 1e3, 0, 2**64 - 1, "time [s]") % 2**32


def microseconds(seconds: float) -> int:
    """A time [s] as uint64 us."""
    return _scaled(seconds, 1e6, 0, 2**64 - 1, "time [s]")


def millivolts(volts: float) -> int:
    """A voltage [V] as uint16 mV; NaN as 65535, unknown."""
    return _UNKNOWN_UINT16 if math.isnan(volts) else _scaled(volts, 1e3, 0, 0xFFFE, "voltage [V]")


def centiamperes(amperes: float) -> int:
    """A current [A] as int16 cA; NaN as -1, unknown."""
    return -1 if math.isnan(amperes) else _scaled(amperes, 1e2, 0, 2**15 - 1, "current [A]")


def percent(share: float) -> int:
    """A share 0..1 as int8 percent; NaN as -1, unknown."""
    return -1 if math.isnan(share) else _scaled(share, 1e2, 0, 100, "share [-]")


def coordinates(frame: int, x: int, y: int) -> tuple[float, float]:
    """Position x, y of COMMAND_INT or MISSION_ITEM_INT: [deg] in global frames, else [m]; NaN means default."""
    scale = from_e7 if is_global_frame(frame) else from_local_e4
    return tuple(math.nan if v == UNKNOWN_INT32 else scale(v) for v in (x, y))  # type: ignore[return-value]
