"""Gains of the line-of-sight law for an airframe."""

from __future__ import annotations

from functools import cache

import numpy as np

from sitl.control.forward_flight.forward_guidance import CELLS_PER_SPEED, GuidanceGains
from sitl.control.forward_flight.line_of_sight import LineOfSightGains
from sitl.design.trim import level_trim
from sitl.model.airframe import Airframe, Array
from sitl.model.vectors import Vector, scaled

# The braking tables: at these airspeeds, decelerate so hard and climb so fast.
BRAKE_AIR = (0.0, 3.5, 4.5, 6.0, 8.0, 9.5, 11.0, 13.0, 15.0, 18.0, 22.0)
BRAKE_RATE = (2.2, 2.2, 2.2, 2.2, 2.4, 3.0, 3.0, 2.4, 1.7, 1.25, 1.1)  # above 12 m/s idling motors give no more
BRAKE_CLIMB = (0.0, 0.0, 1.5, 2.4, 2.5, 2.4, 1.5, 0.0, 0.0, 0.0, 0.0)
HALVING_LATENCY = 0.06  # latency with which the attitude is followed at half the bandwidth [s]


@cache  # asked for at every leg; nobody changes its arrays
def line_of_sight_gains(latency: float = 0.0) -> LineOfSightGains:
    """The law's gains.

    Args:
        latency: From inertial reading to actuator, beyond the control period [s]. The attitude is followed the more
            slowly the later the elevons act: at full bandwidth one back transition of seven is lost with 40 ms.
    """
    share = HALVING_LATENCY / (HALVING_LATENCY + latency)
    guidance = GuidanceGains(
        k_v=1.0,
        k_i=0.3,
        max_integral=4.0,
        max_forward=3.0,
        min_turn=3.0,
        max_turn=8.0,
        k_z=0.6,
        k_vz=1.5,
        max_rise=8.0,
        max_sink=2.5,
        max_up=8.0,
        max_down=6.0,
        max_jerk=20.0,
        brake_rate=_resampled(BRAKE_RATE),
        brake_climb=_resampled(BRAKE_CLIMB),
        min_brake_rate=min(BRAKE_RATE),
        climb_share=0.3,
        climb_from=0.7,
        climb_full=0.9,
        creep=2.5,
        max_climb=8.0,
        near=0.8,
    )
    return LineOfSightGains(
        guidance=guidance,
        attitude=scaled(Vector(5.0, 5.0, 4.0), share),
        rate=scaled(Vector(20.0, 18.0, 14.0), share),
        max_rate=4.0,
        observer=8.0 * share,
        turn_filter=12.0,
        blend_from=4.0,
        blend_to=7.0,
    )


def _resampled(values: tuple[float, ...]) -> Array:
    """A braking table on the even grid of the law, on which all its airspeeds lie."""
    grid = np.arange(BRAKE_AIR[-1] * CELLS_PER_SPEED + 1.0) / CELLS_PER_SPEED
    return np.round(np.interp(grid, BRAKE_AIR, values), 12)  # whatever the processor makes of the last bit


@cache
def can_fly_forward(a: Airframe) -> bool:
    """Whether level flight has a trim at every speed from the hover to 15 m/s, so that both transitions exist."""
    return all(level_trim(a, 0.5 * step).exists for step in range(31))
