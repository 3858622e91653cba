"""Flight modes of the vehicle on the wire, and names of other autopilots' modes, whose recordings are replayed too.

ArduPilot's numbers are PLANE_MODE, COPTER_MODE, ROVER_MODE and SUB_MODE of MAVLink's ardupilotmega dialect. PX4's
custom mode has the main mode in the third byte and the sub-mode of AUTO in the fourth.
"""

from __future__ import annotations

import math
from enum import Enum

from protocol.dialect import mavlink

__all__ = [
    "UNSUPPORTED_PX4_MODES",
    "Mode",
    "custom_mode",
    "mode_from_custom",
    "mode_from_parts",
    "mode_name",
]


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
