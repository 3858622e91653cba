"""The fields of set-points and sticks, as this project's vehicle takes them.

Fields that the type mask of a set-point leaves out may have any value. What else cannot be flown (a place outside the
arena, a speed between hover and forward flight) the autopilot refuses.

https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_LOCAL_NED
"""

from __future__ import annotations

from collections.abc import Mapping

from protocol.ranges.item_ranges import ALTITUDE
from protocol.ranges.value_range import ValueRange, finite, whole

__all__ = ["MESSAGE_RANGES", "STICK_SCALE", "UNUSED_AXIS", "message_flaw"]

STICK_SCALE = 1000  # value of an axis of MANUAL_CONTROL at its end
UNUSED_AXIS = 0x7FFF  # value of an axis that the sender does not have

_AXIS = whole("", -STICK_SCALE, STICK_SCALE, also=(UNUSED_AXIS,))


def _given(name: str, limit: float, unit: str) -> ValueRange:
    return finite(name, -limit, limit, unit, default=False)


_POSITION = {name: _given(name, 1e7, "m") for name in ("x", "y", "z")}
_GLOBAL_POSITION = {
    "lat_int": _given("lat_int", 90e7, "degE7"),
    "lon_int": _given("lon_int", 180e7, "degE7"),
    "alt": ALTITUDE._replace(name="alt"),
}
_MOTION = {
    **{name: ValueRange(name, default=False) for name in ("vx", "vy", "vz", "afx", "afy", "afz")},
    **{name: ValueRange(name) for name in ("yaw", "yaw_rate")},
}

MESSAGE_RANGES: dict[str, dict[str, ValueRange]] = {
    "SET_POSITION_TARGET_LOCAL_NED": _POSITION | _MOTION,
    "SET_POSITION_TARGET_GLOBAL_INT": _GLOBAL_POSITION | _MOTION,
    "SET_ATTITUDE_TARGET": {
        **{f"q[{k}]": _given(f"q[{k}]", 2.0, "") for k in range(4)},
        **{f"body_{axis}_rate": _given(f"body_{axis}_rate", 1e3, "rad/s") for axis in ("roll", "pitch", "yaw")},
        "thrust": finite("thrust", 0.0, 1.0, default=False),
    },
    "MANUAL_CONTROL": {
        **{axis: _AXIS._replace(name=axis) for axis in ("x", "y", "r")},
        "z": _AXIS._replace(name="z", minimum=0),
    },
}


def message_flaw(message: str, values: Mapping[str, float]) -> str:
    """Reason why a message cannot have the values of these fields; empty if it can."""
    for field, value in values.items():
        allowed = MESSAGE_RANGES[message][field]
        if not allowed.allows(value):
            return f"{allowed.name} is {value:g}, not {allowed.words}"
    return ""
