"""Gains of INDI."""

from __future__ import annotations

from functools import cache

from sitl.control.indi import IndiGains
from sitl.control.indi_guidance import IndiGuidanceGains
from sitl.model.vectors import Vector


@cache
def indi_gains() -> IndiGains:
    """The law's gains: angular accelerations and forces, so that they serve airframes of any mass and inertia."""
    return IndiGains(
        guidance=IndiGuidanceGains(
            k_p=1.0,
            k_v=1.8,
            k_z=1.0,
            k_vz=2.0,
            brake=2.0,
            brake_fast=1.3,
            max_forward=3.0,
            min_turn=3.0,
            max_turn=8.0,
            max_rise=4.0,
            max_sink=2.5,
            max_up=8.0,
            max_down=6.0,
            max_jerk=10.0,
            climb=3.0,
            climb_from=0.6,
            climb_full=0.9,
            max_climb=10.0,
        ),
        attitude=Vector(6.0, 6.0, 4.0),
        rate=Vector(14.0, 13.0, 10.0),
        max_rate=6.0,
        turn_filter=1.0,
        force_filter=8.0,
        moment_filter=40.0,
        course_rate=2.0,
        blend_from=4.0,
        blend_to=7.0,
    )
