"""Gains of the attitude law, and what its thrust is a share of."""

from __future__ import annotations

from sitl.model.airframe import Airframe
from sitl.laws.hover_attitude import AttitudeGains


def attitude_gains() -> AttitudeGains:
    """The reference is as quick as the elevons follow it at the thrust of a hover."""
    return AttitudeGains(bandwidth=6.0, most_rate=3.0, most_acceleration=15.0, force_rate=20.0, observer=8.0)


def full_force(a: Airframe) -> float:
    """Force along the nose with both motors at their limit, at rest [N]."""
    return 2.0 * (1.0 - a.S_ratio * a.C_d0) * a.k_f * a.omega_max**2
