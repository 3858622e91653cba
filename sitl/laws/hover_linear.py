"""Linear hover law u = u_bar - K x - K_i x_i and its Lyapunov value (report, sections 3.1.3 and 5.1).

The law lives in the heading frame: the world turned about the vertical so that the wanted heading is north.
There x = (p - p_e, v, eps - eps_bar, w), with eps_bar that of the hover attitude and the sign of q chosen so that
q . q_bar > 0; x_i is the integral of p - p_e (see :func:`integrate`).
"""

import math
from typing import NamedTuple

from numba import njit

from sitl.model.airframe import Array
from sitl.kernels.state import P, Q, V, W

HALF = math.sqrt(0.5)


class LinearGains(NamedTuple):
    """Gains of the law; the columns of K are the entries of x."""

    K: Array  # (4, 12)
    K_i: Array  # (4, 3); zero for LQR
    S: Array  # (12, 12), V = x' S x
    u_bar: Array  # (4,), virtual commands T1, T2 [N], d1 T1, d2 T2 [N rad]
    lead: float  # time constant of the lead in the integral [s]
    integral_limit: float  # bound of what is integrated, per axis [m]
    reach: float = 6.0  # position error beyond this counts as this [m]; math.inf is the report's law
    bound: float = 40.0  # of the integral itself, per axis [m s]; a 10 m/s wind needs 26 of it


@njit(cache=True)
def error(plant: Array, target: Array, heading: float, x: Array) -> None:
    """Deviation from the hover at ``target`` in the heading frame, written into ``x`` (12,).

    Args:
        plant: Plant state, (SIZE,).
        target: Wanted position, world NWU, (3,) [m].
        heading: Wanted heading [rad].
        x: Receives (p - p_e, v, eps - eps_bar, w).
    """
    c, s = math.cos(heading), math.sin(heading)
    north, west = plant[P] - target[0], plant[P + 1] - target[1]
    x[0], x[1], x[2] = c * north + s * west, c * west - s * north, plant[P + 2] - target[2]
    x[3], x[4], x[5] = c * plant[V] + s * plant[V + 1], c * plant[V + 1] - s * plant[V], plant[V + 2]
    ch, sh = math.cos(0.5 * heading), math.sin(0.5 * heading)
    qw, qx, qy, qz = plant[Q], plant[Q + 1], plant[Q + 2], plant[Q + 3]
    # q_z(-heading) ⊗ q
    w, i, j, k = ch * qw + sh * qz, ch * qx + sh * qy, ch * qy - sh * qx, ch * qz - sh * qw
    sign = 1.0 if w - j >= 0.0 else -1.0
    x[6], x[7], x[8] = sign * i, sign * j + HALF, sign * k
    x[9], x[10], x[11] = plant[W], plant[W + 1], plant[W + 2]


@njit(cache=True)
def control(x: Array, integral: Array, heading: float, gains: LinearGains, u: Array) -> None:
    """Virtual commands (T1, T2 [N], d1 T1, d2 T2 [N rad]), written into ``u`` (4,).

    The position error is shortened to ``gains.reach``. Without that, offsets beyond 8 m (7.5 m with the integral)
    saturate the thrusts' difference and the vehicle is lost; with it, it comes home from 20 m, V falling all the
    way, while nothing changes within reach.

    Args:
        x: Deviation in the heading frame, (12,).
        integral: Integral of p - p_e in the *world* frame, (3,) [m s]: what it cancels, a wind, does not turn
            with the wanted heading.
        heading: Wanted heading [rad].
        gains: Gains of the law.
        u: Receives the commands.
    """
    c, s = math.cos(heading), math.sin(heading)
    ahead, left = c * integral[0] + s * integral[1], c * integral[1] - s * integral[0]
    distance = math.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
    near = min(1.0, gains.reach / max(distance, 1e-9))
    for row in range(4):
        value = gains.u_bar[row] - gains.K_i[row, 0] * ahead - gains.K_i[row, 1] * left
        value -= gains.K_i[row, 2] * integral[2]
        for column in range(12):
            value -= gains.K[row, column] * x[column] * (near if column < 3 else 1.0)
        u[row] = value


@njit(cache=True)
def lyapunov(x: Array, gains: LinearGains) -> float:
    """V = x' S x."""
    value = 0.0
    for row in range(12):
        for column in range(12):
            value += x[row] * gains.S[row, column] * x[column]
    return value


@njit(cache=True)
def integrate(plant: Array, target: Array, integral: Array, gains: LinearGains, dt: float) -> None:
    """Advance the integral of p - p_e + lead v in place, world frame, (3,) [m s].

    The lead is the LQI's own proportional action seen from the other side (the gains give it back in K), so
    near the target this *is* the LQI. But while a distance is flown off, error and speed cancel in it, and
    the integral does not wind up into an overshoot. What is integrated is bounded, and so is the integral. It
    is not stopped while an actuator is at its limit: elevons touch theirs on the way into every wind above 5 m/s, and
    stopping it there, tried in winds of 3 to 14 m/s, gains nothing.
    """
    for axis in range(3):
        rate = plant[P + axis] - target[axis] + gains.lead * plant[V + axis]
        rate = min(max(rate, -gains.integral_limit), gains.integral_limit)
        integral[axis] = min(max(integral[axis] + dt * rate, -gains.bound), gains.bound)
