"""Linear hover law u = u_bar - K x - K_i x_i and its Lyapunov value (report, sections 3.1.3 and 5.1).

The law lives in the heading frame: the world turned about the vertical so that the wanted heading is north.
There x = (p - p_e, v, eps - eps_bar, w), with eps_bar that of the hover attitude and q on the side of q_bar that
:mod:`sitl.control.attitude_loop` keeps, or the nearer one where V is asked for; x_i is the integral of p - p_e (see
:func:`integrate`).
"""

import math
from typing import NamedTuple

import numpy as np

from sitl.compiled import kernel
from sitl.control.allocation import Virtual, allocate
from sitl.control.attitude_loop import NOT_CHOSEN, kept
from sitl.control.estimate import Estimate, air_ahead
from sitl.control.reference import Reference
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import clipped, heading_trigonometry
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, level_norm, norm, scaled

SQRT_HALF = math.sqrt(0.5)


class LinearGains(NamedTuple):
    """Gains of the law; the columns of K are the entries of x."""

    K: Array  # (4, 12)
    K_i: Array  # (4, 3); zero for LQR
    S: Array  # (12, 12), symmetric: V = x' S x
    u_bar: Virtual  # at the hover
    lead: float  # time constant of the lead in the integral [s]
    integral_limit: float  # bound of what is integrated, per axis [m]
    reach: float = 6.0  # position error beyond this counts as this [m]; math.inf is the report's law
    # How far ahead the point that is followed is, by the speed it asks for: along the belly's heading, and across [s].
    headway: float = math.inf
    headway_aside: float = math.inf
    bound: float = 40.0  # of the integral itself, per axis [m s]; a 10 m/s wind needs 26 of it
    S_xi: Array = np.zeros((12, 3))  # what V has of the integral besides: 2 x' S_xi x_i + x_i' S_ii x_i
    S_ii: Array = np.zeros((3, 3))


class LinearState(NamedTuple):
    """State slots of the law."""

    integral: Vector  # world frame [m s]
    side: float  # of the quaternion


class HoverError(NamedTuple):
    """Deviation from the hover at the target, in the heading frame."""

    position: Vector  # p - p_e [m]
    velocity: Vector  # [m/s]
    tilt: Vector  # eps - eps_bar [-]
    rates: Vector  # body FLU [rad/s]


@kernel
def error(estimate: Estimate, target: Vector, heading: float) -> HoverError:
    """Deviation from the hover at ``target`` (world NWU [m]) with the wanted heading [rad], q on the nearer side."""
    return error_on(side_after(NOT_CHOSEN, estimate, heading), estimate, target, heading)


@kernel
def side_after(side: float, estimate: Estimate, heading: float) -> float:
    """The side of q about the hover attitude after its jumps."""
    sh, ch, _, _ = heading_trigonometry(heading)
    q = estimate.attitude
    return kept(side, SQRT_HALF * (ch * q.w + sh * q.z - (ch * q.y - sh * q.x)))


@kernel
def error_on(side: float, estimate: Estimate, target: Vector, heading: float) -> HoverError:
    """The deviation with q on a side."""
    sh, ch, s, c = heading_trigonometry(heading)
    p, v, q = estimate.position, estimate.velocity, estimate.attitude
    north, west = p.x - target.x, p.y - target.y
    # the vector part of q_z(-heading) ⊗ q
    i, j, k = ch * q.x + sh * q.y, ch * q.y - sh * q.x, ch * q.z - sh * q.w
    return HoverError(
        Vector(c * north + s * west, c * west - s * north, p.z - target.z),
        Vector(c * v.x + s * v.y, c * v.y - s * v.x, v.z),
        Vector(side * i, side * j + SQRT_HALF, side * k),
        estimate.rates,
    )


@kernel
def control(x: HoverError, integral: Vector, heading: float, gains: LinearGains) -> Virtual:
    """Virtual commands.

    The position error is shortened to ``gains.reach``. Without that, offsets beyond 8 m (7.5 m with the integral)
    saturate the thrusts' difference and the vehicle is lost; with it, it comes home from 20 m, V falling all the
    way, while nothing changes within reach.

    Args:
        x: Deviation in the heading frame.
        integral: Integral of p - p_e in the *world* frame [m s]: what it cancels, a wind, does not turn with the
            wanted heading.
        heading: Wanted heading [rad].
        gains: Gains of the law.
    """
    learnt = _ahead(integral, heading)
    near = min(1.0, gains.reach / max(norm(x.position), 1e-9))
    seen = HoverError(scaled(x.position, near), x.velocity, x.tilt, x.rates)
    return Virtual(
        gains.u_bar.T1 - _feedback(0, seen, learnt, gains),
        gains.u_bar.T2 - _feedback(1, seen, learnt, gains),
        gains.u_bar.dT1 - _feedback(2, seen, learnt, gains),
        gains.u_bar.dT2 - _feedback(3, seen, learnt, gains),
    )


@kernel
def governed(x: HoverError, speed: float, gains: LinearGains) -> HoverError:
    """The deviation from the point that is followed: it leads by no more than its headway at the speed limit [m/s].

    So a far target asks for no more speed than that, in level flight; the heights of the two are the same.
    """
    p = x.position
    asked = level_norm(p.x / gains.headway, p.y / gains.headway_aside)
    share = min(1.0, speed / max(asked, 1e-9))
    return HoverError(Vector(share * p.x, share * p.y, p.z), x.velocity, x.tilt, x.rates)


@kernel
def lyapunov(estimate: Estimate, reference: Reference, gains: LinearGains) -> float:
    """V of the deviation from the reference's position and heading, with nothing in the integral."""
    return quadratic(error(estimate, reference.position, reference.heading), gains.S)


@kernel
def integral_share(estimate: Estimate, reference: Reference, gains: LinearGains, integral: Vector) -> float:
    """Contribution of the integral (world frame [m s]) to V: 2 x' S_xi x_i + x_i' S_ii x_i."""
    x = error(estimate, reference.position, reference.heading)
    learnt = _ahead(integral, reference.heading)
    S, own = gains.S_xi, _diagonal(learnt, gains.S_ii, 0)
    crossed = _off_diagonal(x.position, S, 0, 0, learnt) + _off_diagonal(x.velocity, S, 3, 0, learnt)
    crossed += _off_diagonal(x.tilt, S, 6, 0, learnt) + _off_diagonal(x.rates, S, 9, 0, learnt)
    value: float = own + 2.0 * crossed
    return value


@kernel
def quadratic(x: HoverError, S: Array) -> float:
    """V = x' S x; of the symmetric S (12, 12) the upper triangle is read."""
    p, v, e, w = x.position, x.velocity, x.tilt, x.rates
    crossed = _off_diagonal(p, S, 0, 3, v) + _off_diagonal(p, S, 0, 6, e) + _off_diagonal(p, S, 0, 9, w)
    crossed += _off_diagonal(v, S, 3, 6, e) + _off_diagonal(v, S, 3, 9, w) + _off_diagonal(e, S, 6, 9, w)
    return (_diagonal(p, S, 0) + _diagonal(v, S, 3)) + (_diagonal(e, S, 6) + _diagonal(w, S, 9)) + 2.0 * crossed


@kernel
def integrate(estimate: Estimate, target: Vector, integral: Vector, gains: LinearGains, dt: float) -> Vector:
    """The integral of p - p_e + lead v after ``dt``, world frame [m s].

    The lead is the LQI's own proportional action seen from the other side (the gains give it back in K), so
    near the target this *is* the LQI. But while a distance is flown off, error and speed cancel in it, and
    the integral does not wind up into an overshoot. What is integrated is bounded, and so is the integral. It
    is not stopped while an actuator is at its limit: elevons touch theirs on the way into every wind above 5 m/s, and
    stopping it there, tried in winds of 3 to 14 m/s, gains nothing.
    """
    p, v = estimate.position, estimate.velocity
    return Vector(
        _integrated(integral.x, p.x - target.x, v.x, gains, dt),
        _integrated(integral.y, p.y - target.y, v.y, gains, dt),
        _integrated(integral.z, p.z - target.z, v.z, gains, dt),
    )


@kernel
def step(
    estimate: Estimate, reference: Reference, gains: LinearGains, a: Airframe, state: LinearState, dt: float
) -> tuple[Actuators, int, LinearState]:
    """One tick: actuator commands, DARKO_SATURATION bits, and the state after it."""
    integral, side = state.integral, side_after(state.side, estimate, reference.heading)
    x = error_on(side, estimate, reference.position, reference.heading)
    x = governed(x, reference.speed, gains)
    command, saturation = allocate(control(x, integral, reference.heading, gains), a, air_ahead(estimate))
    seen = _no_farther(reference.position, estimate.position, reference.speed * gains.lead)
    return command, saturation, LinearState(integrate(estimate, seen, integral, gains, dt), side)


@kernel
def _no_farther(target: Vector, p: Vector, most: float) -> Vector:
    """The target, or the point at its height towards it that is so far away on the level [m]."""
    x, y = target.x - p.x, target.y - p.y
    distance = level_norm(x, y)
    if distance <= most:
        return target
    share = most / distance
    return Vector(p.x + share * x, p.y + share * y, target.z)


@kernel
def _ahead(integral: Vector, heading: float) -> Vector:
    """The integral in the heading frame."""
    _, _, s, c = heading_trigonometry(heading)
    return Vector(c * integral.x + s * integral.y, c * integral.y - s * integral.x, integral.z)


@kernel
def _feedback(row: int, x: HoverError, learnt: Vector, gains: LinearGains) -> float:
    """A row of K x + K_i x_i."""
    K, K_i = gains.K, gains.K_i
    p, v, e, w = x.position, x.velocity, x.tilt, x.rates
    integral = K_i[row, 0] * learnt.x + K_i[row, 1] * learnt.y + K_i[row, 2] * learnt.z
    # Two sums side by side are quicker than one long one.
    moving = (K[row, 0] * p.x + K[row, 1] * p.y + K[row, 2] * p.z) + (
        K[row, 3] * v.x + K[row, 4] * v.y + K[row, 5] * v.z
    )
    turning = (K[row, 6] * e.x + K[row, 7] * e.y + K[row, 8] * e.z) + (
        K[row, 9] * w.x + K[row, 10] * w.y + K[row, 11] * w.z
    )
    value: float = (moving + turning) + integral
    return value


@kernel
def _diagonal(x: Vector, S: Array, at: int) -> float:
    """The form x' B x of the symmetric block B of S (3, 3) at (at, at)."""
    squares = S[at, at] * x.x * x.x + S[at + 1, at + 1] * x.y * x.y + S[at + 2, at + 2] * x.z * x.z
    products = S[at, at + 1] * x.x * x.y + S[at, at + 2] * x.x * x.z + S[at + 1, at + 2] * x.y * x.z
    value: float = squares + 2.0 * products
    return value


@kernel
def _off_diagonal(x: Vector, S: Array, row: int, column: int, y: Vector) -> float:
    """The form x' B y of the block B of S (3, 3) at (row, column)."""
    first = S[row, column] * y.x + S[row, column + 1] * y.y + S[row, column + 2] * y.z
    second = S[row + 1, column] * y.x + S[row + 1, column + 1] * y.y + S[row + 1, column + 2] * y.z
    third = S[row + 2, column] * y.x + S[row + 2, column + 1] * y.y + S[row + 2, column + 2] * y.z
    value: float = x.x * first + x.y * second + x.z * third
    return value


@kernel
def _integrated(integral: float, off: float, v: float, gains: LinearGains, dt: float) -> float:
    rate = clipped(off + gains.lead * v, -gains.integral_limit, gains.integral_limit)
    return clipped(integral + dt * rate, -gains.bound, gains.bound)
