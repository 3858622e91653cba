"""PX4's custom modes, which MAVSDK, MAVProxy and QGroundControl understand: main << 16 | sub << 24."""

import math
from enum import Enum

__all__ = ["UNSUPPORTED_PX4_MODES", "Mode", "custom_mode", "mode_from_custom", "mode_from_parts"]


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
