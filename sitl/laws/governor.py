"""Saturations of the position loop: gamma(e_p, e_v) of the zero-moment law (report, section 3.2.1).

Far from the target the linear gamma = -k_pp e_p - k_pd e_v asks for more force than the actuators have. A
*reference governor* saturates the force, an *error governor* the errors. Neither bounds the speed by itself
(a quasi time-optimal one reaches v = sqrt(2 M d)), so a velocity governor saturates the position error at the
distance that a speed limit corresponds to.
"""

import math
from typing import NamedTuple

from numba import njit

LINEAR, ERROR, QUASI_OPTIMAL_AXIS, QUASI_OPTIMAL_NORM, VELOCITY = 0, 1, 2, 3, 4
GOMPERTZ, ARCTAN = 0, 1  # sigmoids of the quasi time-optimal governors

Vector = tuple[float, float, float]


class GovernorParameters(NamedTuple):
    """Which saturation, and its limits."""

    kind: int  # LINEAR ... VELOCITY
    k_pp: float  # position gain [N/m]
    k_pd: float  # velocity gain [N s/m]
    m: float  # mass [kg]
    M: float  # acceleration the quasi time-optimal governor may ask for [m/s2]
    error_limit: float  # error governor: largest error per axis, in m and in m/s
    v_down: float  # velocity governor: descent limit [m/s]
    v_up: float  # velocity governor: climb limit [m/s]
    sigmoid: int = GOMPERTZ  # quasi time-optimal governors: GOMPERTZ or ARCTAN


@njit(cache=True)
def gompertz(x: float, M: float) -> float:
    """Odd Gompertz sigmoid with unit slope at zero and limits ±M.

    The report prints sigma(x) = 2 M exp(-exp(b - c x)) - M with b = -ln(1/2), c = 1: that is -0.73 M at zero. With
    b = ln(ln 2) it vanishes there, with c = 1 / (M ln 2) its slope is one; it is still not odd, so it is
    mirrored.
    """
    tail = math.exp(math.log(math.log(2.0)) - abs(x) / (M * math.log(2.0)))
    return math.copysign(2.0 * M * math.exp(-tail) - M, x)


@njit(cache=True)
def arctan_sigmoid(x: float, M: float) -> float:
    """Sigmoid 2 M / pi arctan(pi x / 2 M): unit slope at zero, limits ±M."""
    return 2.0 * M / math.pi * math.atan(0.5 * math.pi * x / M)


@njit(cache=True)
def softened(x: float, limit: float) -> float:
    """Factor that keeps |x| below ``limit``: near one inside, smooth everywhere."""
    return float((1.0 + (x / limit) ** 4) ** -0.25)


@njit(cache=True)
def gamma(e: Vector, v: Vector, speed: float, p: GovernorParameters) -> Vector:
    """Force asked of the position loop on top of the weight, world frame [N].

    Args:
        e: Position error p - p_r [m].
        v: Velocity error [m/s].
        speed: Horizontal speed limit of the velocity governor [m/s].
        p: The governor.
    """
    if p.kind == ERROR:
        limit = p.error_limit
        e = (_clip(e[0], limit), _clip(e[1], limit), _clip(e[2], limit))
        v = (_clip(v[0], limit), _clip(v[1], limit), _clip(v[2], limit))
    elif p.kind == VELOCITY:
        e = _velocity_limited(e, speed, p)
    elif p.kind in {QUASI_OPTIMAL_AXIS, QUASI_OPTIMAL_NORM}:
        return _quasi_optimal(e, v, p)
    return (
        -p.k_pp * e[0] - p.k_pd * v[0],
        -p.k_pp * e[1] - p.k_pd * v[1],
        -p.k_pp * e[2] - p.k_pd * v[2],
    )


@njit(cache=True)
def activity(e: Vector, v: Vector, speed: float, p: GovernorParameters) -> float:
    """Share of the linear force that the governor takes away, 0..1."""
    asked = math.hypot(
        math.hypot(p.k_pp * e[0] + p.k_pd * v[0], p.k_pp * e[1] + p.k_pd * v[1]),
        p.k_pp * e[2] + p.k_pd * v[2],
    )
    given = gamma(e, v, speed, p)
    taken = math.hypot(
        math.hypot(given[0] + p.k_pp * e[0] + p.k_pd * v[0], given[1] + p.k_pp * e[1] + p.k_pd * v[1]),
        given[2] + p.k_pp * e[2] + p.k_pd * v[2],
    )
    return min(1.0, taken / asked) if asked > 1e-6 else 0.0


@njit(cache=True)
def _clip(x: float, limit: float) -> float:
    return min(max(x, -limit), limit)


@njit(cache=True)
def _velocity_limited(e: Vector, speed: float, p: GovernorParameters) -> Vector:
    reach = p.k_pd / p.k_pp  # metres of error that ask for one metre per second
    level = softened(math.hypot(e[0], e[1]), speed * reach)
    vertical = softened(e[2], (p.v_down if e[2] > 0.0 else p.v_up) * reach)
    return e[0] * level, e[1] * level, e[2] * vertical


@njit(cache=True)
def _quasi_optimal(e: Vector, v: Vector, p: GovernorParameters) -> Vector:
    """Quasi time-optimal stabiliser -m sigma_M((k_pp/m)(e_p + e_v mu(|e_v| / 2M, k_pd / k_pp)))."""
    gain, ratio = p.k_pp / p.m, p.k_pd / p.k_pp
    if p.kind == QUASI_OPTIMAL_AXIS:
        return (
            -p.m * _sigmoid(gain * (e[0] + v[0] * _smooth_maximum(abs(v[0]) / (2.0 * p.M), ratio)), p),
            -p.m * _sigmoid(gain * (e[1] + v[1] * _smooth_maximum(abs(v[1]) / (2.0 * p.M), ratio)), p),
            -p.m * _sigmoid(gain * (e[2] + v[2] * _smooth_maximum(abs(v[2]) / (2.0 * p.M), ratio)), p),
        )
    horizon = _smooth_maximum(math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2) / (2.0 * p.M), ratio)
    x, y, z = gain * (e[0] + v[0] * horizon), gain * (e[1] + v[1] * horizon), gain * (e[2] + v[2] * horizon)
    n = math.sqrt(x * x + y * y + z * z)
    scale = -p.m * (_sigmoid(n, p) / n if n > 1e-9 else 1.0)
    return scale * x, scale * y, scale * z


@njit(cache=True)
def _sigmoid(x: float, p: GovernorParameters) -> float:
    return arctan_sigmoid(x, p.M) if p.sigmoid == ARCTAN else gompertz(x, p.M)


@njit(cache=True)
def _smooth_maximum(a: float, b: float) -> float:
    return float((a**4 + b**4) ** 0.25)
