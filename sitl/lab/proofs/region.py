r"""A sublevel set of V = x' S x that the linear hover law provably never leaves (report, sections 3.1 and 5.1).

The closed loop x' = (A - B K) x + r(x) is written as x' = (A - B K + M) x, where M depends on the attitude, the
rates and the airspeed only, and V' < 0 follows where

.. math:: W - (S M + M' S) \succ 0, \qquad W = -(A - B K)' S - S (A - B K)

holds for every M the set allows. The attitude is covered by boxes, which are split until each is proved: on a box M is
affine in (d1, e2, d3) but for terms of second order, which interval arithmetic bounds; rates and airspeed enter
as the corners of what {V <= c} leaves of them once the attitude's share is taken.

With q = q_bar ⊗ (d0, d1, d2, d3) and e = eps - eps_bar, the attitude's coordinates are d1 = (e1 + e3) / sqrt2,
e2, d3 = (e3 - e1) / sqrt2, and kappa = 1 - d0, d2 = sqrt2 e2 - kappa.

What is in: every term of the plant in still air (rotation, quaternion kinematics, gyroscopic moment, all of the
airspeed's forces and moments), the full allocation. What is assumed: actuators that follow at once and a law in
continuous time, no wind, no ground, no integral, exact parameters, eigenvalues exact to 1e-9.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl import Airframe, Array, SitlError
from sitl.control.hover_linear import SQRT_HALF, LinearGains
from sitl.lab.proofs.closed_loop import (
    ATTITUDE_ROWS,
    INTEGRAL_ROWS,
    POSITION_ROWS,
    RATE_ROWS,
    VELOCITY_ROWS,
    feedback,
    lyapunov_matrix,
)
from sitl.lab.proofs.cover import MAX_BOXES, falls_within
from sitl.lab.proofs.proof import Proof
from sitl.lab.proofs.stalled import MAX_DRIFT, thrust_slope

PRECISION = 0.05  # of the level, relative
RATE_HALVINGS = 12  # of the interval that the rate limit's level is sought in
MIN_LEVEL = 1e-5  # below which a set is not worth the name


class Certificate(NamedTuple):
    """Levels of V below which something is proved; the set is proved up to the smallest."""

    decrease: float  # V' < 0 below it, as far as the others hold
    saturation: float  # no actuator meets a position limit below it
    rate: float  # no actuator meets a rate limit below it
    reach: float  # nothing that the law bounds is bounded: the position error, the integral and what it grows by
    chart: float  # the nose cannot turn through the attitudes that x does not tell apart below it

    @property
    def level(self) -> float:
        """The certified level: {V <= level} with eta > 0 is invariant and in the region of attraction."""
        return min(self)


def certify(
    a: Airframe, gains: LinearGains, *, precision: float = PRECISION, sampled: bool = True, boxes: int = MAX_BOXES
) -> Certificate:
    """The largest sublevel set of V that can be proved, by bisection.

    Args:
        a: The airframe.
        gains: A law, and its V.
        precision: Of the level, relative, > 0.
        sampled: Whether commands are late, as they fly, or in force at once.
        boxes: How many boxes of attitudes may be left to split.

    Raises:
        SitlError: If V proves nothing.
    """
    proof = Proof.of(a, gains, sampled=sampled)
    saturation, reach, chart = saturation_level(a, gains), reach_level(gains), chart_level(gains)
    high = min(saturation, reach, chart)
    rate = rate_level(a, proof, high) if sampled else math.inf
    high = low = min(high, rate)
    while not falls_within(proof, low, boxes):
        low, high = 0.25 * low, low
        if low < MIN_LEVEL:
            raise SitlError("no sublevel set of V can be proved: its decrease about the hover is too small")
    while high > (1.0 + precision) * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if falls_within(proof, middle, boxes) else (low, middle)
    return Certificate(low, saturation, rate, reach, chart)


def saturation_level(a: Airframe, gains: LinearGains) -> float:
    """Smallest V at which the law can ask an actuator for its position limit.

    Every limit is a half-space: |d1| <= delta_max is |u3| <= delta_max u1. Of c' x <= bound, the ellipsoid
    touches the plane at V = bound^2 / (c' P^-1 c).
    """
    by_inflow = MAX_DRIFT * thrust_slope(a)
    low, high = a.k_f * a.omega_min**2 + by_inflow, a.k_f * a.omega_max**2 - by_inflow
    planes, K, P = [], feedback(gains), lyapunov_matrix(gains)
    for motor, elevon in ((0, 2), (1, 3)):
        T, K_T, K_d = gains.u_bar[motor], K[motor], K[elevon]
        planes += [(K_T, T - low), (-K_T, high - T)]
        planes += [(a.delta_max * K_T + sign * K_d, a.delta_max * T) for sign in (-1.0, 1.0)]
    return float(min(bound * bound / (normal @ np.linalg.solve(P, normal)) for normal, bound in planes))


def rate_level(a: Airframe, proof: Proof, high: float) -> float:
    """A V up to which no command changes faster than its actuator can follow, at most ``high``."""
    if _follows(a, proof, high):
        return high
    low = 0.0
    for _ in range(RATE_HALVINGS):
        level = 0.5 * (low + high)
        low, high = (level, high) if _follows(a, proof, level) else (low, level)
    return low


def _follows(a: Airframe, proof: Proof, level: float) -> bool:
    rates = proof.greatest_rates(level)
    if rates is None:
        return False
    motor, elevon = rates
    return motor < a.omega_rate and elevon < a.delta_rate


def reach_level(gains: LinearGains) -> float:
    """Smallest V at which the law bounds something: the position error, its integral, or what that grows by."""
    C = np.linalg.inv(lyapunov_matrix(gains))
    growth = np.hstack([np.eye(3), gains.lead * np.eye(3), np.zeros((3, len(C) - 6))])
    bounds = [(C[POSITION_ROWS, POSITION_ROWS], gains.reach)]
    if len(C) > INTEGRAL_ROWS.start:
        bounds += [(growth @ C @ growth.T, gains.integral_limit), (C[INTEGRAL_ROWS, INTEGRAL_ROWS], gains.bound)]
    return float(min(bound**2 / np.linalg.eigvalsh(part)[-1] for part, bound in bounds))


def radii(gains: LinearGains, level: float) -> tuple[float, float, float, float]:
    """Radii of {V <= level} in any direction when all else is zero, the integral, too.

    Position [m], speed, turn [rad] and rates.

    A turn by theta has |eps - eps_bar| <= 2 sin(theta / 4), at most theta / 2.
    """
    p, v, e, w = (
        math.sqrt(level / np.linalg.eigvalsh(gains.S[part, part])[-1])
        for part in (POSITION_ROWS, VELOCITY_ROWS, ATTITUDE_ROWS, RATE_ROWS)
    )
    return p, v, 4.0 * math.asin(min(1.0, 0.5 * e)), w


def chart_level(gains: LinearGains) -> float:
    r"""Smallest V at which eta = 0, |eps| = 1.

    x holds eps alone, so two attitudes share each x, and with the sign that the law takes both can be meant: turned
    over its back until the nose points straight down, q = (-1, 0, -1, 0)/sqrt2, the vehicle has the x of the hover,
    and V = 0. Below this level the two are apart. The minimum of (n - eps_bar)' S_e (n - eps_bar) over the sphere
    equals the maximum of its dual, every value of which is a lower bound.
    """
    S_e = _marginal(lyapunov_matrix(gains), ATTITUDE_ROWS)
    values, vectors = np.linalg.eigh(S_e)
    upright = np.array([0.0, -SQRT_HALF, 0.0])
    pull = vectors.T @ S_e @ upright

    def dual(shift: float) -> float:
        return float(shift + upright @ S_e @ upright - np.sum(pull**2 / (values - shift)))

    low, high = values[0] - 2.0 * float(np.linalg.norm(pull)) - 1.0, float(values[0]) * (1.0 - 1e-9)
    for _ in range(200):
        left, right = low + (high - low) / 3.0, high - (high - low) / 3.0
        low, high = (low, right) if dual(left) > dual(right) else (left, high)
    return dual(low)


def _marginal(S: Array, part: slice) -> Array:
    """The quadratic form min over the other entries of x' S x."""
    return np.asarray(np.linalg.inv(np.linalg.inv(S)[part, part]))
