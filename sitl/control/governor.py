"""Saturations of the position loop: gamma(e_p, e_v) of the zero-moment law (report, section 3.2.1).

Far from the target the linear gamma = -k_pp e_p - k_pd e_v asks for more force than the actuators have. A
*reference governor* saturates the force, an *error governor* the errors. Neither bounds the speed by itself
(a quasi time-optimal one reaches v = sqrt(2 M d)), so a velocity governor saturates the position error at the
distance that a speed limit corresponds to.
"""

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.model.arithmetic import arctangent, clipped, exponential
from sitl.model.vectors import Vector, add, norm, scaled

LINEAR, ERROR, QUASI_OPTIMAL_AXIS, QUASI_OPTIMAL_NORM, VELOCITY = 0, 1, 2, 3, 4
GOMPERTZ, ARCTAN = 0, 1  # sigmoids of the quasi time-optimal governors
LN_2 = 0.6931471805599453
FLAT = 50.0  # beyond this many widths a sigmoid is at its limit to rounding


class GovernorParameters(NamedTuple):
    """Kind and limits of the governor's saturation."""

    kind: int  # LINEAR ... VELOCITY
    k_pp: float  # position gain [N/m]
    k_pd: float  # velocity gain [N s/m]
    m: float  # mass [kg]
    M: float  # acceleration the quasi time-optimal governor may ask for [m/s2]
    error_limit: float  # error governor: largest error per axis, in m and in m/s
    v_down: float  # velocity governor: descent limit [m/s]
    v_up: float  # velocity governor: climb limit [m/s]
    sigmoid: int = GOMPERTZ  # quasi time-optimal governors: GOMPERTZ or ARCTAN


@kernel
def gompertz(x: float, M: float) -> float:
    """Odd Gompertz sigmoid with unit slope at zero and limits ±M.

    The report prints sigma(x) = 2 M exp(-exp(b - c x)) - M with b = -ln(1/2), c = 1: that is -0.73 M at zero. With
    b = ln(ln 2) it vanishes there, with c = 1 / (M ln 2) its slope is one; it is still not odd, so it is
    mirrored. Written as M (exp(ln 2 (1 - exp(-c x))) - 1), it vanishes at zero to the bit.
    """
    rise = 1.0 - exponential(-min(abs(x) / (M * LN_2), FLAT))
    sigma = M * (exponential(LN_2 * rise) - 1.0)
    return -sigma if x < 0.0 else sigma


@kernel
def arctan_sigmoid(x: float, M: float) -> float:
    """Sigmoid 2 M / pi arctan(pi x / 2 M): unit slope at zero, limits ±M."""
    return 2.0 * M / math.pi * arctangent(0.5 * math.pi * x / M, 1.0)


@kernel
def softened(x: float, limit: float) -> float:
    """Factor that keeps |x| below ``limit``: near one inside, smooth everywhere."""
    return _softening(x * x, limit)


@kernel
def gamma(e: Vector, v: Vector, speed: float, p: GovernorParameters) -> Vector:
    """Force asked of the position loop on top of the weight, world frame [N].

    Args:
        e: Position error p - p_r [m].
        v: Velocity error [m/s].
        speed: Horizontal speed limit of the velocity governor [m/s].
        p: The governor.
    """
    if p.kind in (QUASI_OPTIMAL_AXIS, QUASI_OPTIMAL_NORM):
        return _quasi_optimal(e, v, p)
    if p.kind == ERROR:
        return _linear(_boxed(e, p.error_limit), _boxed(v, p.error_limit), p)
    if p.kind == VELOCITY:
        return _linear(_velocity_limited(e, speed, p), v, p)
    return _linear(e, v, p)


@kernel
def activity(e: Vector, v: Vector, speed: float, p: GovernorParameters) -> float:
    """Share of the linear force that the governor takes away, 0..1; arguments as for :func:`gamma`."""
    asked = _linear(e, v, p)
    size = norm(asked)
    taken = norm(add(gamma(e, v, speed, p), scaled(asked, -1.0)))
    return min(1.0, taken / size) if size > 1e-6 else 0.0


@kernel
def _linear(e: Vector, v: Vector, p: GovernorParameters) -> Vector:
    return Vector(-p.k_pp * e.x - p.k_pd * v.x, -p.k_pp * e.y - p.k_pd * v.y, -p.k_pp * e.z - p.k_pd * v.z)


@kernel
def _boxed(a: Vector, limit: float) -> Vector:
    return Vector(clipped(a.x, -limit, limit), clipped(a.y, -limit, limit), clipped(a.z, -limit, limit))


@kernel
def _softening(square: float, limit: float) -> float:
    """(1 + (x / limit)^4)^(-1/4) of the square of x."""
    ratio = square * (1.0 / (limit * limit))
    return 1.0 / math.sqrt(math.sqrt(1.0 + ratio * ratio))


@kernel
def _velocity_limited(e: Vector, speed: float, p: GovernorParameters) -> Vector:
    reach = p.k_pd / p.k_pp  # metres of error that ask for one metre per second
    level = _softening(e.x * e.x + e.y * e.y, speed * reach)
    vertical = _softening(e.z * e.z, (p.v_down if e.z > 0.0 else p.v_up) * reach)
    return Vector(e.x * level, e.y * level, e.z * vertical)


@subroutine
def _quasi_optimal(e: Vector, v: Vector, p: GovernorParameters) -> Vector:
    """Quasi time-optimal stabiliser -m sigma_M((k_pp/m)(e_p + e_v mu(|e_v| / 2M, k_pd / k_pp)))."""
    gain, ratio, half = p.k_pp / p.m, p.k_pd / p.k_pp, 1.0 / (2.0 * p.M)
    if p.kind == QUASI_OPTIMAL_AXIS:
        return Vector(
            -p.m * _sigmoid(gain * (e.x + v.x * _smooth_maximum(half * abs(v.x), ratio)), p),
            -p.m * _sigmoid(gain * (e.y + v.y * _smooth_maximum(half * abs(v.y), ratio)), p),
            -p.m * _sigmoid(gain * (e.z + v.z * _smooth_maximum(half * abs(v.z), ratio)), p),
        )
    horizon = _smooth_maximum(half * norm(v), ratio)
    wanted = scaled(Vector(e.x + v.x * horizon, e.y + v.y * horizon, e.z + v.z * horizon), gain)
    size = norm(wanted)
    return scaled(wanted, -p.m * (_sigmoid(size, p) / size if size > 1e-9 else 1.0))


@subroutine
def _sigmoid(x: float, p: GovernorParameters) -> float:
    return arctan_sigmoid(x, p.M) if p.sigmoid == ARCTAN else gompertz(x, p.M)


@kernel
def _smooth_maximum(a: float, b: float) -> float:
    a, b = a * a, b * b
    return math.sqrt(math.sqrt(a * a + b * b))
