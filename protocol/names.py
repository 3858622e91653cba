"""Names of numbers on the wire: flight modes, laws, failures, parameters, commands, enumerations of the dialect.

ArduPilot's numbers are PLANE_MODE, COPTER_MODE, ROVER_MODE and SUB_MODE of MAVLink's ardupilotmega dialect. PX4's
custom mode has the main mode in the third byte and the sub-mode of AUTO in the fourth.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import Final, TypeVar

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, LabelledEnum, Law, LegMode, Reason, Regime

Member = TypeVar("Member", bound=LabelledEnum)


def as_member(enum: type[Member], number: int) -> Member | None:
    """A number of the dialect as a member of its enum; None if only a newer vehicle knows it."""
    try:
        return enum(number)
    except ValueError:
        return None


def name_of(enum: type[LabelledEnum], number: int) -> str:
    """A number of the dialect as programs name it; an unknown number as its digits."""
    member = as_member(enum, number)
    return str(number) if member is None else member.name


def enum_name(enum: str, value: int, prefix: str | None = None) -> str:
    """The name of an enum's value without its prefix, such as "DENIED" for 2 of MAV_RESULT.

    Args:
        enum: Name of the enum.
        value: The value; one without a name gives the enum's name and the number.
        prefix: What the names begin with, if it is not the enum's name.
    """
    entry = mavlink.enums[enum].get(value)
    return str(entry.name).removeprefix(f"{prefix or enum}_") if entry else f"{enum} {value}"


TRANSITIONS: Final = (Regime.FRONT_TRANSITION, Regime.BACK_TRANSITION)


def law_label(number: int) -> str:
    """A DARKO_LAW in plain words: the law of a transition is called as the transition; an unknown one "law 12"."""
    law = as_member(Law, number)
    if law is None:
        return f"law {number}"
    return law.regime.label if law.regime in TRANSITIONS else law.label


def law_words(name: str) -> str:
    """The same of a law's name in programs: "front transition" of "TO_FORWARD"; another name in lower case."""
    return law_label(Law[name]) if name in Law.__members__ else name.replace("_", " ").lower()


def reason_words(name: str) -> str:
    """A jump's reason as the screens say it: "V below threshold" of "LYAPUNOV_BELOW"; another name in lower case."""
    return _label(Reason, name)


_CALM_WANTED = {(Law.INDI.name, Law.HOVER_LINEAR.name), (Law.TO_HOVER.name, Law.HOVER_LINEAR.name)}


def calm_words(law_from: str, law_to: str, reason: str) -> str:
    """The wind that a jump waits for, to stand before its reason: "wind below 3 m/s, "; empty of others.

    It stands first, as narrow lists cut the end: while it is windy, V is below the threshold for long.
    """
    is_asked = reason == Reason.LYAPUNOV_BELOW.name and (law_from, law_to) in _CALM_WANTED
    return "wind below 3 m/s, " if is_asked else ""


def cause_words(law_from: str, law_to: str, reason: str) -> str:
    """The cause of a jump, from the names of its laws and its reason: "wind below 3 m/s, V below threshold"."""
    return calm_words(law_from, law_to, reason) + reason_words(reason)


def leg_words(mode: str, reason: str) -> str:
    """A leg mode and its reason, as the screens say them: "forward: less energy" of "FORWARD" and "ENERGY"."""
    return f"{_label(LegMode, mode)}: {_label(DecisionReason, reason)}"


def _label(enum: type[LabelledEnum], name: str) -> str:
    return enum[name].label if name in enum.__members__ else name.replace("_", " ").lower()


def _named(enum: str) -> dict[str, int]:
    """The values of an enumeration by their short names, such as gyro or motor."""
    skipped = (f"{enum}_", "SENSOR_", "SYSTEM_")
    values = {}
    for number, entry in mavlink.enums[enum].items():
        name = str(entry.name)
        for prefix in skipped:
            name = name.removeprefix(prefix)
        if name != "ENUM_END":
            values[name.lower()] = number
    return values


FAILURE_UNITS, FAILURE_TYPES = _named("FAILURE_UNIT"), _named("FAILURE_TYPE")


MAX_NAME_LENGTH = 16
"""Characters of a parameter's name on the wire, which are ASCII."""


FORCE_ARM_DISARM = 21196
"""param2 of MAV_CMD_COMPONENT_ARM_DISARM: arm or disarm without the usual checks.

https://mavlink.io/en/messages/common.html#MAV_CMD_COMPONENT_ARM_DISARM
"""

NO_CHANGE, DEFAULT_SPEED = -1.0, -2.0
"""param2 and param3 of MAV_CMD_DO_CHANGE_SPEED: leave speed or throttle as it is, or return to the vehicle's own.

https://mavlink.io/en/messages/common.html#MAV_CMD_DO_CHANGE_SPEED
"""


class Mode(Enum):
    """Flight modes as (main mode, sub-mode)."""

    MANUAL = (1, 0)
    ALTCTL = (2, 0)
    POSCTL = (3, 0)
    READY = (4, 1)
    TAKEOFF = (4, 2)
    HOLD = (4, 3)
    MISSION = (4, 4)
    RTL = (4, 5)
    LAND = (4, 6)
    FLIGHT_PLAN = (4, 11)  # the first of those that PX4 leaves to others
    ACRO = (5, 0)
    OFFBOARD = (6, 0)
    STABILIZED = (7, 0)

    @property
    def is_auto(self) -> bool:
        """True if the vehicle flies itself, without a stream of set-points."""
        return self in _AUTO


UNSUPPORTED_PX4_MODES = {(4, 8): "FOLLOW_TARGET", (4, 9): "PRECISION_LAND", (8, 0): "RATTITUDE"}


def custom_mode(mode: Mode) -> int:
    """HEARTBEAT.custom_mode of a mode."""
    main, sub = mode.value
    return main << 16 | sub << 24


_AUTO = frozenset({Mode.READY, Mode.TAKEOFF, Mode.HOLD, Mode.MISSION, Mode.RTL, Mode.LAND, Mode.FLIGHT_PLAN})
_BY_NUMBER = {custom_mode(mode): mode for mode in Mode}


def mode_from_custom(number: int) -> Mode | None:
    """The mode of HEARTBEAT.custom_mode; None if it is not one of ours."""
    return _BY_NUMBER.get(number)


def mode_from_parts(main: float, sub: float) -> Mode | None:
    """The mode that param2 and param3 of MAV_CMD_DO_SET_MODE ask for; only AUTO has sub-modes."""
    parts = tuple(0 if math.isnan(part) else part for part in (main, sub))
    return next((mode for mode in Mode if mode.value == parts or (not mode.is_auto and mode.value[0] == main)), None)


PLANE_MODES = {
    0: "MANUAL", 1: "CIRCLE", 2: "STABILIZE", 3: "TRAINING", 4: "ACRO", 5: "FBWA", 6: "FBWB", 7: "CRUISE",
    8: "AUTOTUNE", 10: "AUTO", 11: "RTL", 12: "LOITER", 13: "TAKEOFF", 14: "AVOID_ADSB", 15: "GUIDED",
    16: "INITIALISING", 17: "QSTABILIZE", 18: "QHOVER", 19: "QLOITER", 20: "QLAND", 21: "QRTL", 22: "QAUTOTUNE",
    23: "QACRO", 24: "THERMAL", 25: "LOITERALTQLAND", 26: "AUTOLAND",
}  # fmt: skip
COPTER_MODES = {
    0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 5: "LOITER", 6: "RTL", 7: "CIRCLE",
    8: "POSITION", 9: "LAND", 10: "OF_LOITER", 11: "DRIFT", 13: "SPORT", 14: "FLIP", 15: "AUTOTUNE", 16: "POSHOLD",
    17: "BRAKE", 18: "THROW", 19: "AVOID_ADSB", 20: "GUIDED_NOGPS", 21: "SMART_RTL", 22: "FLOWHOLD", 23: "FOLLOW",
    24: "ZIGZAG", 25: "SYSTEMID", 26: "AUTOROTATE", 27: "AUTO_RTL", 28: "TURTLE", 29: "RATE_ACRO",
}  # fmt: skip
ROVER_MODES = {
    0: "MANUAL", 1: "ACRO", 3: "STEERING", 4: "HOLD", 5: "LOITER", 6: "FOLLOW", 7: "SIMPLE", 8: "DOCK", 9: "CIRCLE",
    10: "AUTO", 11: "RTL", 12: "SMART_RTL", 15: "GUIDED", 16: "INITIALISING",
}  # fmt: skip
SUB_MODES = {
    0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 7: "CIRCLE", 9: "SURFACE", 16: "POSHOLD",
    19: "MANUAL", 20: "MOTOR_DETECT", 21: "SURFTRAK",
}  # fmt: skip
PX4_MAIN_MODES = {
    1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 4: "AUTO", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED", 8: "RATTITUDE",
}  # fmt: skip
PX4_AUTO_MODES = {
    1: "READY", 2: "TAKEOFF", 3: "HOLD", 4: "MISSION", 5: "RTL", 6: "LAND", 8: "FOLLOW_TARGET", 9: "PRECLAND",
    10: "VTOL_TAKEOFF",
}  # fmt: skip
PX4_AUTO = 4  # main mode with sub-modes
PLANE_TYPES = frozenset(
    {mavlink.MAV_TYPE_FIXED_WING, *range(mavlink.MAV_TYPE_VTOL_DUOROTOR, mavlink.MAV_TYPE_VTOL_RESERVED5 + 1)}
)
ROVER_TYPES = frozenset({mavlink.MAV_TYPE_GROUND_ROVER, mavlink.MAV_TYPE_SURFACE_BOAT})
SUB_TYPES = frozenset({mavlink.MAV_TYPE_SUBMARINE})
COPTER_TYPES = frozenset(
    {
        mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_TYPE_COAXIAL, mavlink.MAV_TYPE_HELICOPTER, mavlink.MAV_TYPE_HEXAROTOR,
        mavlink.MAV_TYPE_OCTOROTOR, mavlink.MAV_TYPE_TRICOPTER, mavlink.MAV_TYPE_DODECAROTOR,
    }
)  # fmt: skip


ARDUPILOT_MODES = (
    (PLANE_TYPES, PLANE_MODES), (COPTER_TYPES, COPTER_MODES), (ROVER_TYPES, ROVER_MODES), (SUB_TYPES, SUB_MODES),
)  # fmt: skip


def mode_name(autopilot: int, kind: int, number: int) -> str | None:
    """Name of HEARTBEAT.custom_mode; None for an unknown mode.

    Args:
        autopilot: MAV_AUTOPILOT.
        kind: MAV_TYPE; ArduPilot numbers its modes by type of vehicle.
        number: HEARTBEAT.custom_mode.
    """
    if autopilot == mavlink.MAV_AUTOPILOT_PX4:
        return _px4(number)
    if autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
        return next((modes.get(number) for types, modes in ARDUPILOT_MODES if kind in types), None)
    return None


def _px4(number: int) -> str | None:
    mode = mode_from_custom(number)
    if mode is not None:
        return mode.name
    main, sub = number >> 16 & 0xFF, number >> 24
    return PX4_AUTO_MODES.get(sub) if main == PX4_AUTO else PX4_MAIN_MODES.get(main)


# Meanings of the MAV_FRAMEs (https://mavlink.io/en/messages/common.html#MAV_FRAME). A frame with _INT in its name means
# the same as the frame without.
ABSOLUTE_ALTITUDE_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT})
"""Latitude, longitude, altitude above mean sea level."""

RELATIVE_ALTITUDE_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT})
"""Latitude, longitude, altitude above home."""

_TERRAIN_ALTITUDE_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT, mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT})

GLOBAL_FRAMES = ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES | _TERRAIN_ALTITUDE_FRAMES
"""x and y are latitude and longitude."""

BODY_FRAMES = frozenset({mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED, mavlink.MAV_FRAME_BODY_FRD})
"""Axes turn with the vehicle."""

OFFSET_FRAMES = frozenset(
    {mavlink.MAV_FRAME_LOCAL_OFFSET_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED, mavlink.MAV_FRAME_BODY_FRD}
)
"""Positions count from where the vehicle is."""


def is_global_frame(frame: int) -> bool:
    """True if x and y in this MAV_FRAME are latitude and longitude."""
    return frame in GLOBAL_FRAMES
