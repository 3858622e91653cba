"""The autopilot's settings, each backed by a parameter on the wire."""

from __future__ import annotations

from typing import NamedTuple


class Settings(NamedTuple):
    """Numbers a pilot may change in flight; SI units."""

    takeoff_altitude: float = 2.5  # MIS_TAKEOFF_ALT [m]
    return_altitude: float = 5.0  # RTL_RETURN_ALT [m]
    climb_rate: float = 1.0  # MPC_TKO_SPEED [m/s]
    descent_rate: float = 0.5  # MPC_LAND_SPEED [m/s]
    hover_speed: float = 3.0  # DRK_HOV_VMAX: beyond, the hover laws lose the wing-normal axis [m/s]
    airspeed: float = 15.0  # DRK_FWD_SPEED: of the cruise [m/s]
    way: int = 0  # DRK_WAY: 0 the better one, 1 always hover, 2 forward flight wherever possible
    min_leg: float = 25.0  # DRK_FWD_LEG: shorter legs are hovered [m]
    leg_time: float = 0.0  # DRK_LEG_TIME: time limit per leg [s]; 0: none
    loiter_radius: float = 40.0  # NAV_LOITER_RAD: of circles nobody gave a radius for [m]
    acceptance: float = 0.5  # NAV_ACC_RAD [m]
    setpoint_timeout: float = 0.5  # COM_OF_LOSS_T [s]
    setpoint_action: int = 5  # COM_OBL_RC_ACT: when they stop, 3 return, 4 land, 5 hold
    battery_low: float = 0.15  # BAT_LOW_THR, share below which arming is refused
    battery_critical: float = 0.07  # BAT_CRIT_THR, share that is not to be flown with
    battery_action: int = 3  # COM_LOW_BAT_ACT: 0 warn, 2 land when critical, 3 return in time
    fence_action: int = 2  # GF_ACTION: 0 no fence, 1 warn, 2 hold, 3 return, 5 land
    fence_reach: float = 0.0  # GF_MAX_HOR_DIST: from home [m]; 0: any
    fence_ceiling: float = 0.0  # GF_MAX_VER_DIST: above home [m]; 0: any
    link_timeout: float = 10.0  # COM_DL_LOSS_T [s]
    link_action: int = 0  # NAV_DLL_ACT: 0 go on, 1 hold, 2 return, 3 land
    companion_timeout: float = 5.0  # COM_OBC_LOSS_T [s]
    companion_action: int = 0  # DRK_OBC_ACT: 0 go on, 1 hold, 2 return, 3 land
    one_operator: int = 1  # DRK_ONE_GCS: in control is 0 everyone, 1 who asked for it, 2 also who armed
    stick_timeout: float = 0.5  # COM_RC_LOSS_T [s]
    disarm_after: float = 2.0  # COM_DISARM_LAND: disarm this long after touching down [s]
