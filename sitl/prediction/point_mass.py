"""Model for the prediction of a leg: an airframe with its laws, as a point mass whose attitude is in equilibrium."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sitl.control.forward_flight.forward_guidance import GuidanceGains
from sitl.control.governor import GovernorParameters
from sitl.control.hover_linear import LinearGains
from sitl.model.airframe import Airframe, Array
from sitl.simulation.tuning import Tuning, designed
from sitl.supervisor.guards import Thresholds


class LinearHover(NamedTuple):
    """The linear hover law as a point mass feels it, and its V."""

    k_p: float  # level position [1/s2]
    k_v: float  # level velocity [1/s]
    k_z: float  # altitude [1/s2]
    k_vz: float  # climb rate [1/s]
    k_i: float  # integral of the level error [1/s3]
    k_iz: float  # integral of the altitude error [1/s3]
    lead: float  # of the integral [s]
    integral_limit: float  # [m]
    reach: float  # [m]
    headway: float  # of the point that is followed [s]
    S: Array  # of V, (12, 12)
    v_enter: float
    v_leave: float
    v_waited: float
    settled: float  # V below which a stop in forward flight hands over


class PointMass(NamedTuple):
    """The airframe with its laws; numbers are floats whatever the tuning's are, so that it is compiled for once."""

    airframe: Airframe
    guidance: GuidanceGains
    governor: GovernorParameters
    linear: LinearHover
    lag: float  # of the attitude in forward flight [s]
    hover_lag: float  # of the attitude in the hover [s]
    k_delta: float  # of the zero-moment law [1/s]
    lam: float  # its attitude bandwidth [rad/s]
    turn: float  # bandwidth of the heading in the alignment [rad/s]
    blend_from: float  # airspeeds between which the heading gives way to the air stream [m/s]
    blend_to: float


class Prediction(NamedTuple):
    """Time and energy of one way of flying a leg; infinite where it cannot be flown so."""

    time: float  # [s]
    energy: float  # as the airframe counts it [J]


IMPOSSIBLE = Prediction(math.inf, math.inf)


@lru_cache(maxsize=8)
def point_mass(a: Airframe, tuning: Tuning) -> PointMass:
    """The point mass of a design.

    Args:
        a: The airframe as the laws are designed for it.
        tuning: Parameters of the laws as they are now.
    """
    design = designed(a, tuning)
    loop, sight = design.gains.zero_moment, design.gains.line_of_sight
    governor = loop.governor
    return PointMass(
        airframe=a,
        guidance=sight.guidance,
        governor=governor._replace(k_pp=float(governor.k_pp), k_pd=float(governor.k_pd)),
        linear=_linear_hover(a, design.gains.hover_linear, design.thresholds),
        lag=float(1.0 / sight.rate.y),  # the rest is fed forward
        hover_lag=float(2.0 * loop.zeta / loop.lam),
        k_delta=float(loop.k_delta),
        lam=float(loop.lam),
        turn=float(loop.k_q),
        blend_from=float(sight.blend_from),
        blend_to=float(sight.blend_to),
    )


def _linear_hover(a: Airframe, gains: LinearGains, thresholds: Thresholds) -> LinearHover:
    K, K_i = gains.K, gains.K_i
    pitch = 2.0 * math.sqrt(2.0) * a.g / K[2, 7]  # level acceleration of an attitude the elevons hold
    heave = 2.0 * (1.0 - a.S_ratio * a.C_d0) / a.m
    return LinearHover(
        k_p=float(pitch * K[2, 0]),
        k_v=float(pitch * K[2, 3]),
        k_z=float(heave * K[0, 2]),
        k_vz=float(heave * K[0, 5]),
        k_i=float(pitch * K_i[2, 0]),
        k_iz=float(heave * K_i[0, 2]),
        lead=float(gains.lead),
        integral_limit=float(gains.integral_limit),
        reach=float(gains.reach),
        headway=float(gains.headway),
        S=np.ascontiguousarray(gains.S),
        v_enter=thresholds.v_enter,
        v_leave=thresholds.v_leave,
        v_waited=thresholds.v_waited,
        settled=thresholds.v_settled,
    )
