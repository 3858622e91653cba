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
    airspeed: float = 15.0  # DRK_FWD_SPEED: of the cruise on the wing [m/s]
    way: int = 0  # DRK_WAY: 0 the better one, 1 always hover, 2 on the wing wherever possible
    least_leg: float = 25.0  # DRK_FWD_LEG: shorter legs are hovered [m]
    leg_time: float = 0.0  # DRK_LEG_TIME: a leg shall take no longer [s]; 0: no matter
    loiter_radius: float = 40.0  # NAV_LOITER_RAD: of circles nobody gave a radius for [m]
    acceptance: float = 0.5  # NAV_ACC_RAD [m]
    setpoint_timeout: float = 0.5  # COM_OF_LOSS_T [s]
    battery_low: float = 0.15  # BAT_LOW_THR, share below which arming is refused
    disarm_after: float = 2.0  # COM_DISARM_LAND: disarm this long after touching down [s]
