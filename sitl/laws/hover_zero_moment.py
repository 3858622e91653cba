r"""Hierarchical zero-moment law (report, section 3.2 and appendix D, corrected).

The thrust direction d of a desired attitude q_d is steered so that R(q_d) d f becomes the force f_r that the
position loop wants; the attitude loop makes q follow q_d. With f_D = R(q_d) d f - f_r:

.. math::
    \nu = \dot f_r - k_\Delta f_\Delta, \quad
    \omega_d = \tfrac1f [d]_\times R(q_d)^\top \nu - k_q d d^\top \epsilon'_\Delta, \quad
    \dot f = d^\top R(q_d)^\top \nu

For the linear gamma this nu is the report's; written so, it holds for every governor. The rate of f_r is taken
along (e_v, a): with a the acceleration that q_d promises it is the report's nu, with the one that q gives it
is nu', which makes f_D a first-order lag. The feed-forward is the derivative of omega_d along the same flow:
for nu' that is appendix D's; for nu it leaves out the terms in R(q) - R(q_d), which brings the report's hover case
home 0.06 s sooner and costs nothing in recoveries from afar.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.model.airframe import Array
from sitl.kernels.quaternion import (
    conjugate,
    from_rotation_vector,
    multiply,
    normalised,
    rotate,
    rotate_inverse,
)
from sitl.kernels.state import P, Q, V, W
from sitl.laws.governor import GovernorParameters, gamma

F = 4  # index of f in the law's state (q_d, f)
SIZE = 5
AHEAD = 1e-4  # step of the directional derivatives [s]


class ZeroMomentGains(NamedTuple):
    """Gains, and what the law must know of the plant it flies."""

    governor: GovernorParameters
    k_delta: float  # convergence of f_D [1/s]
    lam: float  # attitude bandwidth [rad/s]
    zeta: float  # attitude damping ratio [-]
    k_q: float  # heading convergence [rad/s]
    nu_prime: int  # 1: nu', 0: nu
    m: float  # mass [kg]
    g: float  # gravity [m/s2]
    J: Array  # principal inertias, (3,) [kg m2]
    d: Array  # thrust direction in the body frame, (3,): x_b for DarkO, z_b for a quadrotor
    M_pinv: Array  # pseudo-inverse of M_b, (4, 3)
    u_bar: Array  # commands of a unit force without moment, (4,)
    f_min: float  # bounds of f: it must stay positive, and within what the motors give [N]
    f_max: float


@njit(cache=True)
def reset(plant: Array, f: float, law: Array, gains: ZeroMomentGains) -> None:
    """Jump map on entering the law: q_d = q and f = the force measured, so that nothing steps.

    Args:
        plant: Plant state.
        f: Force along d that the actuators give now [N].
        law: Receives (q_d, f), (5,).
        gains: Gains of the law.
    """
    for i in range(4):
        law[i] = plant[Q + i]
    law[F] = _bounded(f, gains)


@njit(cache=True)
def control(
    plant: Array,
    law: Array,
    target: Array,
    q_ref: Array,
    speed: float,
    gains: ZeroMomentGains,
    dt: float,
    u: Array,
) -> None:
    """One tick of the law: virtual commands into ``u`` (4,), the law's state (q_d, f) advanced by ``dt``.

    Args:
        plant: Plant state (position and velocity world NWU, rates body).
        law: q_d and f, (5,), changed in place.
        target: Wanted position, world, (3,) [m].
        q_ref: An attitude with d up and the wanted heading, (4,).
        speed: Horizontal speed limit for the velocity governor [m/s].
        gains: Gains of the law.
        dt: Tick [s].
        u: Receives the commands that M_pinv and u_bar speak of.
    """
    e, v = plant[P : P + 3] - target, plant[V : V + 3]
    q, w, q_d, f = plant[Q : Q + 4], plant[W : W + 3], law[:4], law[F]
    w_d, f_dot = steer(e, v, q, q_d, f, q_ref, speed, gains)
    w_d_dot = feed_forward(e, v, q, w, q_d, f, w_d, f_dot, q_ref, speed, gains)
    realise(attitude_torque(q, w, q_d, w_d, w_d_dot, gains), f, gains, u)
    law[:4] = normalised(multiply(q_d, from_rotation_vector(dt * w_d)))
    law[F] = _bounded(f + dt * f_dot, gains)


@njit(cache=True)
def nu(e: Array, v: Array, q: Array, q_d: Array, f: float, speed: float, gains: ZeroMomentGains) -> Array:
    """Rate at which R(q_d) d f is to change, world frame, (3,) [N/s]: the report's nu, or its nu'."""
    a = acceleration(q if gains.nu_prime else q_d, f, gains)
    f_r = wanted_force(e, v, speed, gains)
    f_r_dot = (wanted_force(e + AHEAD * v, v + AHEAD * a, speed, gains) - f_r) / AHEAD
    f_D = rotate(q_d, gains.d) * f - f_r
    return np.asarray(f_r_dot - gains.k_delta * f_D)


@njit(cache=True)
def steer(
    e: Array, v: Array, q: Array, q_d: Array, f: float, q_ref: Array, speed: float, gains: ZeroMomentGains
) -> tuple[Array, float]:
    """Rates of the law's state: omega_d in the frame of q_d, (3,) [rad/s], and f' [N/s].

    f' stops at the bounds of f, so that omega_d, which divides by f, never meets zero.
    """
    pull = rotate_inverse(q_d, nu(e, v, q, q_d, f, speed, gains))
    off = multiply(conjugate(q_ref), q_d)
    sign = 1.0 if off[0] >= 0.0 else -1.0
    turn = -gains.k_q * sign * np.dot(gains.d, off[1:])
    f_dot = float(np.dot(gains.d, pull))
    if (f <= gains.f_min and f_dot < 0.0) or (f >= gains.f_max and f_dot > 0.0):
        f_dot = 0.0
    return np.cross(gains.d, pull) / f + turn * gains.d, f_dot


@njit(cache=True)
def feed_forward(
    e: Array,
    v: Array,
    q: Array,
    w: Array,
    q_d: Array,
    f: float,
    w_d: Array,
    f_dot: float,
    q_ref: Array,
    speed: float,
    gains: ZeroMomentGains,
) -> Array:
    """Derivative of omega_d along the flow that nu counts on, in the frame of q_d, (3,) [rad/s2]."""
    a = acceleration(q if gains.nu_prime else q_d, f, gains)
    q_next = multiply(q, from_rotation_vector(AHEAD * w))
    q_d_next = multiply(q_d, from_rotation_vector(AHEAD * w_d))
    f_next = _bounded(f + AHEAD * f_dot, gains)
    w_d_next, _ = steer(e + AHEAD * v, v + AHEAD * a, q_next, q_d_next, f_next, q_ref, speed, gains)
    return np.asarray((w_d_next - w_d) / AHEAD)


@njit(cache=True)
def acceleration(q: Array, f: float, gains: ZeroMomentGains) -> Array:
    """What the force f along d gives at attitude q, world frame, (3,) [m/s2]."""
    return np.asarray(rotate(q, gains.d) * (f / gains.m) - np.array((0.0, 0.0, gains.g)))


@njit(cache=True)
def _bounded(f: float, gains: ZeroMomentGains) -> float:
    return min(max(f, gains.f_min), gains.f_max)


@njit(cache=True)
def wanted_force(e: Array, v: Array, speed: float, gains: ZeroMomentGains) -> Array:
    """Force f_r = m g e_3 + gamma(e_p, e_v) that the position loop wants, world, (3,) [N]."""
    x, y, z = gamma((e[0], e[1], e[2]), (v[0], v[1], v[2]), speed, gains.governor)
    return np.array((x, y, z + gains.m * gains.g))


@njit(cache=True)
def realise(torque: Array, f: float, gains: ZeroMomentGains, u: Array) -> None:
    """Virtual commands of a torque, body frame, (3,) [N m], and a force along d [N], written into ``u`` (4,)."""
    for i in range(4):
        moment = gains.M_pinv[i, 0] * torque[0] + gains.M_pinv[i, 1] * torque[1] + gains.M_pinv[i, 2] * torque[2]
        u[i] = moment + gains.u_bar[i] * f


@njit(cache=True)
def attitude_torque(q: Array, w: Array, q_d: Array, w_d: Array, w_d_dot: Array, gains: ZeroMomentGains) -> Array:
    """Torque that makes q follow q_d, body frame, (3,) [N m].

    Args:
        q: Attitude, (4,).
        w: Body rates, (3,) [rad/s].
        q_d: Attitude to follow, (4,).
        w_d: Its rate in its own frame, (3,) [rad/s].
        w_d_dot: The derivative of that, (3,) [rad/s2].
        gains: Gains of the law.
    """
    q_off = multiply(conjugate(q_d), q)
    w_r = rotate_inverse(q_off, w_d)
    w_off = w - w_r
    sign = 1.0 if q_off[0] >= 0.0 else -1.0
    stiff = -2.0 * gains.lam**2 * sign * q_off[1:] - 2.0 * gains.zeta * gains.lam * w_off
    follow = rotate_inverse(q_off, w_d_dot) - np.cross(w_off, w_r)
    return gains.J * (stiff + follow) + np.cross(w, gains.J * w)
