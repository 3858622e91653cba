"""Gains of the line-of-sight law for an airframe."""

from __future__ import annotations

from functools import cache

import numpy as np

from sitl.design.trim import level_trim
from sitl.model.airframe import Airframe
from sitl.laws.air import AirGains
from sitl.laws.forward_guidance import GuidanceGains
from sitl.laws.line_of_sight import SightGains

# The braking tables: at these airspeeds, decelerate so hard and climb so fast.
BRAKE_AIR = (0.0, 3.5, 4.5, 6.0, 8.0, 9.5, 11.0, 13.0, 15.0, 18.0, 22.0)
BRAKE_RATE = (2.2, 2.2, 2.2, 2.2, 2.4, 3.0, 3.0, 2.4, 1.7, 1.25, 1.1)  # above 12 m/s idling motors give no more
BRAKE_CLIMB = (0.0, 0.0, 1.5, 2.4, 2.5, 2.4, 1.5, 0.0, 0.0, 0.0, 0.0)


@cache  # asked for at every leg; nobody changes its arrays
def sight_gains() -> SightGains:
    """The law's gains."""
    guidance = GuidanceGains(
        k_v=1.0,
        k_i=0.3,
        integral_limit=4.0,
        gain=3.0,
        lateral=3.0,
        lateral_most=8.0,
        k_z=0.6,
        k_vz=1.5,
        rise_most=8.0,
        sink_most=2.5,
        up=8.0,
        down=6.0,
        jerk=20.0,
        brake_air=np.array(BRAKE_AIR),
        brake_rate=np.array(BRAKE_RATE),
        brake_climb=np.array(BRAKE_CLIMB),
        climb_share=0.3,
        climb_from=0.7,
        climb_whole=0.9,
        creep=2.5,
        climb_cap=8.0,
        near=0.8,
    )
    return SightGains(
        guidance=guidance,
        attitude=np.array((5.0, 5.0, 4.0)),
        rate=np.array((20.0, 18.0, 14.0)),
        most_rate=4.0,
        observer=8.0,
        turn_filter=12.0,
        blend_from=4.0,
        blend_to=7.0,
    )


def air_gains() -> AirGains:
    """Tuning of the wind estimator: it follows a gust within some 0.2 s in cruise."""
    return AirGains(
        walk=1.0, return_time=300.0, normal_noise=1.0, pitot_noise=0.2, axial_time=8.0, pitot_from=4.0, most=3.0
    )


def can_fly_forward(a: Airframe) -> bool:
    """Whether level flight has a trim at every speed from the hover to 15 m/s, so that both transitions exist."""
    return all(level_trim(a, 0.5 * step).exists for step in range(31))
