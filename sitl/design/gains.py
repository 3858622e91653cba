"""Gains of the laws by the design model: wind estimate, attitude, zero-moment, INDI and forward flight."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from sitl.control.allocation import Virtual
from sitl.control.forward_flight.forward_guidance import CELLS_PER_SPEED, GuidanceGains
from sitl.control.forward_flight.line_of_sight import LineOfSightGains
from sitl.control.governor import VELOCITY, GovernorParameters
from sitl.control.hover_attitude import AttitudeGains
from sitl.control.hover_zero_moment import ZeroMomentGains
from sitl.control.indi import IndiGains
from sitl.control.indi_guidance import IndiGuidanceGains
from sitl.control.wind_estimator import WindGains
from sitl.defaults import GENTLE
from sitl.design.scaling import UNIT_SCALE, Scale, scale_of
from sitl.design.trim import level_trim
from sitl.model.aerodynamics import force_matrix, moment_matrix
from sitl.model.airframe import Airframe, Array
from sitl.model.vectors import Vector, scaled


def wind_gains() -> WindGains:
    """It follows a gust within some 0.2 s in cruise."""
    return WindGains(
        walk=1.0,
        return_time=300.0,
        normal_noise=1.0,
        pitot_noise=0.2,
        axial_time=8.0,
        min_pitot=4.0,
        max_deviation=3.0,
    )


def attitude_gains(loop: ZeroMomentGains, size: Scale = UNIT_SCALE) -> AttitudeGains:
    """The reference is as quick as the elevons follow it at the thrust of a hover; ``loop`` is the attitude loop's."""
    rate = 1.0 / size.time
    return AttitudeGains(
        bandwidth=6.0 * rate,
        max_rate=3.0 * rate,
        max_acceleration=15.0 * rate * rate,
        force_rate=20.0 * rate,
        observer=8.0 * rate,
        loop=loop,
    )


def zero_moment_gains(
    a: Airframe,
    *,
    k_pp: float = 1.5,
    k_pd: float = 1.5,
    k_delta: float = 5.0,
    lam: float = 10.0,
    zeta: float = 0.8,
    k_q: float = 1.0,
    nu_prime: bool = False,
    governor: int = VELOCITY,
) -> ZeroMomentGains:
    """The law's gains; the defaults are the fastest that keep clear of the non-minimum phase.

    The elevons push the vehicle sideways before they turn it (a zero at sqrt(g / l), l = J2 f / (m c2): 6.6 rad/s), so
    k_pp above 2 or lam above 14 destabilise it, nu' sooner than nu. All are of a vehicle of size 1.
    """
    share = 1.0 / float(force_matrix(a)[0, :2].sum())
    size = scale_of(a)
    k_pd *= size.mass / size.time
    k_pp *= size.mass / size.time / size.time
    return ZeroMomentGains(
        governor=GovernorParameters(
            kind=governor, k_pp=k_pp, k_pd=k_pd, m=a.m, M=0.5, error_limit=size.length, v_down=2.0, v_up=2.5
        ),
        k_delta=k_delta / size.time,
        lam=lam / size.time,
        zeta=zeta,
        k_q=k_q / size.time,
        nu_prime=nu_prime,
        m=a.m,
        g=a.g,
        J=Vector(a.J1, a.J2, a.J3),
        d=Vector(1.0, 0.0, 0.0),
        M_pinv=moment_inverse(a),
        u_bar=Virtual(share, share, 0.0, 0.0),
        f_min=0.1 * a.m * a.g,
        f_max=0.95 * 2.0 * a.k_f * a.omega_max**2 + 0.95 * 2.0 * a.k_fw * a.omega_max,
    )


def moment_inverse(a: Airframe) -> tuple[Vector, Vector, Vector, Vector]:
    """Rows of the pseudo-inverse of M_b (4, 3), in closed form.

    M_b's kernel is the sum of the thrusts, so its pseudo-inverse leaves that at zero and inverts the rest: the yaw
    gives the thrusts' difference, the pitch the elevons' sum, the roll less the propellers' torque their difference.
    """
    M = moment_matrix(a)
    torque, roll, pitch, yaw = float(M[0, 0]), float(M[0, 3]), float(-M[1, 2]), float(M[2, 1])
    by_yaw = 0.5 / yaw
    left, right = -0.5 / roll, 0.5 / roll
    both, turn = -0.5 / pitch, 0.5 * torque / (roll * yaw)
    return (
        Vector(0.0, 0.0, -by_yaw),
        Vector(0.0, 0.0, by_yaw),
        Vector(left, both, -turn),
        Vector(right, both, turn),
    )


class Pace(NamedTuple):
    """Gains and limits of INDI's guidance, of a vehicle of size 1; see :class:`IndiGuidanceGains`."""

    k_p: float
    k_v: float
    brake: float
    brake_fast: float
    max_forward: float
    max_rise: float
    max_sink: float
    max_jerk: float
    k_vz: float
    turn_filter: float  # of INDI's attitude [rad/s]
    turn_filter_fast: float  # the same in fast flight [rad/s]
    elevon_lead: float
    low: float


PACES = (  # by GENTLE and BRISK
    Pace(
        k_p=1.0,
        k_v=1.8,
        brake=2.0,
        brake_fast=1.3,
        max_forward=3.0,
        max_rise=4.0,
        max_sink=2.5,
        max_jerk=10.0,
        k_vz=2.0,
        turn_filter=1.0,
        turn_filter_fast=1.0,
        elevon_lead=1.0,
        low=1.0,
    ),
    # Found by flying legs of 10 to 300 m: near the least energy and time (docs/optimal.md). It sinks at less than half
    # of the air's speed through hovering propellers, 9 m/s: faster, they would fly in their own wake. As the wing takes
    # over, the nose has to stop falling at once, or the vehicle sinks: hence the lead and the fast filter.
    Pace(
        k_p=1.6,
        k_v=2.6,
        brake=5.0,
        brake_fast=2.0,
        max_forward=8.0,
        max_rise=8.0,
        max_sink=4.0,
        max_jerk=20.0,
        k_vz=3.0,
        turn_filter=1.0,
        turn_filter_fast=3.0,
        elevon_lead=2.0,
        low=0.0,
    ),
)


@cache
def indi_gains(size: Scale = UNIT_SCALE, pace: int = GENTLE) -> IndiGains:
    """The law's gains: of accelerations, so that mass and inertia do not matter; their rates go with the length.

    Lags do not slow them: a vehicle of 3.6 times the shipped lags holds a point by these, and loses it by slower ones.

    Args:
        size: Of the vehicle.
        pace: ``GENTLE`` or ``BRISK`` of :mod:`sitl.defaults`.
    """
    rate, own = 1.0 / math.sqrt(size.length), PACES[pace]
    return IndiGains(
        guidance=IndiGuidanceGains(
            k_p=own.k_p * rate,
            k_v=own.k_v * rate,
            k_z=1.0 * rate,
            k_vz=own.k_vz * rate,
            brake=own.brake,
            brake_fast=own.brake_fast,
            max_forward=own.max_forward,
            min_turn=3.0,
            max_turn=8.0,
            max_rise=own.max_rise,
            max_sink=own.max_sink,
            max_up=8.0,
            max_down=6.0,
            max_jerk=own.max_jerk * rate,
            low=own.low,
            climb=3.0,
            climb_from=0.6,
            climb_full=0.9,
            max_climb=10.0,
            edge_on_wind=5.0,
            edge_on_below=14.0,
            edge_on_slow=4.0,
        ),
        attitude=scaled(Vector(6.0, 6.0, 4.0), rate),
        rate=scaled(Vector(14.0, 13.0, 10.0), rate),
        max_rate=6.0 * rate,
        turn_filter=own.turn_filter * rate,
        turn_filter_fast=own.turn_filter_fast * rate,
        elevon_lead=own.elevon_lead,
        force_filter=8.0 * rate,
        moment_filter=40.0 * rate,
        course_rate=2.0 * rate,
        blend_from=4.0,
        blend_to=7.0,
    )


# The braking tables: at these airspeeds, decelerate so hard and climb so fast.
BRAKE_AIR = (0.0, 3.5, 4.5, 6.0, 8.0, 9.5, 11.0, 13.0, 15.0, 18.0, 22.0)
BRAKE_RATE = (2.2, 2.2, 2.2, 2.2, 2.4, 3.0, 3.0, 2.4, 1.7, 1.25, 1.1)  # above 12 m/s idling motors give no more
BRAKE_CLIMB = (0.0, 0.0, 1.5, 2.4, 2.5, 2.4, 1.5, 0.0, 0.0, 0.0, 0.0)
HALVING_LATENCY = 0.06  # latency with which the attitude is followed at half the bandwidth [s]


@cache  # asked for at every leg; nobody changes its arrays
def line_of_sight_gains(latency: float = 0.0, size: Scale = UNIT_SCALE) -> LineOfSightGains:
    """The law's gains.

    Args:
        latency: From inertial reading to actuator, beyond the control period [s]. The attitude is followed the more
            slowly the later the elevons act: at full bandwidth one back transition of seven is lost with 40 ms.
        size: Of the vehicle.
    """
    share = HALVING_LATENCY / (HALVING_LATENCY + latency) / size.time
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
        max_rate=4.0 / size.time,
        observer=8.0 * share,
        turn_filter=12.0 / size.time,
        blend_from=4.0,
        blend_to=7.0,
    )


def _resampled(values: tuple[float, ...]) -> Array:
    """A braking table on the even grid of the law, on which all its airspeeds lie."""
    grid = np.arange(BRAKE_AIR[-1] * CELLS_PER_SPEED + 1.0) / CELLS_PER_SPEED
    return np.round(np.interp(grid, BRAKE_AIR, values), 12)  # whatever the processor makes of the last bit


FORWARD_SPEEDS = tuple(0.5 * step for step in range(31))  # from the hover to forward flight [m/s]


@cache
def can_fly_forward(a: Airframe) -> bool:
    """Whether level flight has a trim at every speed from the hover to 15 m/s, so that both transitions exist."""
    return all(level_trim(a, speed).exists for speed in FORWARD_SPEEDS)
