"""Names of flight modes, also of other autopilots, whose recordings can be replayed too.

ArduPilot's numbers are PLANE_MODE, COPTER_MODE, ROVER_MODE and SUB_MODE of MAVLink's ardupilotmega dialect. PX4's
custom mode has the main mode in the third byte and the sub-mode of AUTO in the fourth.
"""

from __future__ import annotations

from protocol.dialect import mavlink
from protocol.names.modes import mode_from_custom

__all__ = ["mode_name"]

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
