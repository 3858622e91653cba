"""Gains of the attitude law."""

from __future__ import annotations

from sitl.control.hover_attitude import AttitudeGains
from sitl.control.hover_zero_moment import ZeroMomentGains


def attitude_gains(loop: ZeroMomentGains) -> AttitudeGains:
    """The reference is as quick as the elevons follow it at the thrust of a hover; ``loop`` is the attitude loop's."""
    return AttitudeGains(bandwidth=6.0, max_rate=3.0, max_acceleration=15.0, force_rate=20.0, observer=8.0, loop=loop)
