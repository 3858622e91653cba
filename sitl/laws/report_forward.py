r"""The report's own line-of-sight law for forward flight (report, section 4.2), with its slips as options.

The velocity is turned towards the target by a moment Gamma; a state of the law, u_bar = (T1 - T2, delta1 + delta2,
delta1 - delta2), follows whatever makes the model's moment M equal to it; the sum of the thrusts holds the speed
along the nose:

.. math::
    \Gamma &= -k_c \, \epsilon_e - k_d \, \omega + \omega \times J \omega, \qquad
    \dot{\bar u} = -k_u \, (\partial M / \partial \bar u)^{\#} \, (M(u') - \Gamma) \\
    T_1 + T_2 &= k_p (v_c - v_{b,x}) + k_i \int (v_c - v_{b,x}) \, dt

Corrected against the report: eps_e, an axis of the world, is turned into the body before it serves as a moment; the
second root of q_e has its missing minus; the PI integrates the error, not v_bx; sign(eta_e) is always one, because
the eta_e of two directions is a square root. ``swapped`` keeps the report's M_y, whose T1 - T2 and T1 + T2 changed
places, and ``singular_floor`` the bounded singular values it asked for on that account. No mode of the vehicle flies
this law: it leaves bank and sideslip alone, which only a target in the vertical plane forgives.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.kernels.airspeed_model import moment, moment_jacobian
from sitl.model.airframe import Airframe, Array
from sitl.kernels.quaternion import rotate_inverse
from sitl.kernels.state import ACTUATOR, P, Q, V, W

INTEGRAL = 3  # index of the speed's integral in the law's state (u_bar, integral)
SIZE = 4


class LineOfSightGains(NamedTuple):
    """Gains, and which of the report's two slips are kept."""

    a: Airframe  # of the model that is inverted
    k_c: float = 0.3  # line of sight [N m]
    k_d: float = 0.1  # rates [N m s]
    k_u: float = 50.0  # convergence of the moment [1/s]
    k_p: float = 1.0  # speed [N s/m]
    k_i: float = 0.5  # its integral [N/m]
    swapped: int = 0  # 1: M_y as the report types it
    singular_floor: float = 0.0  # singular values are kept above this share of the largest


@njit(cache=True)
def reset(plant: Array, law: Array, gains: LineOfSightGains) -> None:
    """Start from where the actuators are: u_bar and the integral reproduce them, so that nothing steps.

    Args:
        plant: Plant state.
        law: Receives (u_bar, integral), (4,).
        gains: Gains of the law.
    """
    w1, w2 = plant[ACTUATOR], plant[ACTUATOR + 1]
    d1, d2 = plant[ACTUATOR + 2], plant[ACTUATOR + 3]
    law[0], law[1], law[2] = gains.a.k_f * (w1 * w1 - w2 * w2), d1 + d2, d1 - d2
    law[INTEGRAL] = gains.a.k_f * (w1 * w1 + w2 * w2) / gains.k_i


@njit(cache=True)
def control(
    plant: Array,
    wind: Array,
    target: Array,
    speed: float,
    gains: LineOfSightGains,
    dt: float,
    law: Array,
    u: Array,
) -> None:
    """One tick of the law: thrusts and deflections into ``u`` (4,), the law's state advanced by ``dt``.

    Args:
        plant: Plant state (position and velocity world NWU, rates body).
        wind: Velocity of the air, world NWU, (3,) [m/s].
        target: Point to fly to, world NWU, (3,) [m].
        speed: Wanted airspeed along the nose v_c [m/s].
        gains: Gains of the law.
        dt: Tick [s].
        law: u_bar and the integral, (4,), changed in place; what the actuators cannot give is not kept.
        u: Receives T1, T2 [N], delta1, delta2 [rad].
    """
    a = gains.a
    q, w = plant[Q : Q + 4], plant[W : W + 3]
    v_b = rotate_inverse(q, plant[V : V + 3] - wind)
    low, high = 2.0 * a.k_f * a.omega_min**2, 2.0 * a.k_f * a.omega_max**2
    total = min(max(gains.k_p * (speed - v_b[0]) + gains.k_i * law[INTEGRAL], low), high)
    off = speed - v_b[0]
    if (total < high or off < 0.0) and (total > low or off > 0.0):
        law[INTEGRAL] += dt * off
    wanted = wanted_moment(plant, target, gains)
    eta = math.sqrt(v_b @ v_b + a.mu * a.c * a.c * (w @ w))
    command = np.array((total, law[0], law[1], law[2]))
    M, J = model(v_b, eta, command, gains)
    rate = limited_inverse(J, gains.singular_floor) @ (M - wanted)
    for i in range(3):
        law[i] -= dt * gains.k_u * rate[i]
    _write(total, law, a, u)


@njit(cache=True)
def _write(total: float, law: Array, a: Airframe, u: Array) -> None:
    """The command of the actuators, and u_bar held within what they can give."""
    low, high = a.k_f * a.omega_min**2, a.k_f * a.omega_max**2
    u[0] = min(max(0.5 * (total + law[0]), low), high)
    u[1] = min(max(0.5 * (total - law[0]), low), high)
    u[2] = min(max(0.5 * (law[1] + law[2]), -a.delta_max), a.delta_max)
    u[3] = min(max(0.5 * (law[1] - law[2]), -a.delta_max), a.delta_max)
    law[0], law[1], law[2] = u[0] - u[1], u[2] + u[3], u[2] - u[3]


@njit(cache=True)
def line_of_sight(plant: Array, target: Array) -> tuple[Array, float]:
    """Vector part of q_e, from the direction of the target to that of the velocity, world (3,), and the angle [rad].

    u_c × u_v / (2 cos(theta / 2)) is the report's expression without its 0/0 at alignment. Where both are opposite
    any axis does: the vertical plane's is taken.
    """
    to, v = target - plant[P : P + 3], plant[V : V + 3]
    distance, speed = math.sqrt(to @ to), math.sqrt(v @ v)
    if distance < 1e-9 or speed < 1e-9:
        return np.zeros(3), 0.0
    u_c, u_v = to / distance, v / speed
    cosine = min(max(float(u_c @ u_v), -1.0), 1.0)
    angle = math.acos(cosine)
    if cosine < -1.0 + 1e-12:
        return np.array((0.0, 1.0, 0.0)), angle
    return np.cross(u_c, u_v) / math.sqrt(2.0 * (1.0 + cosine)), angle


@njit(cache=True)
def wanted_moment(plant: Array, target: Array, gains: LineOfSightGains) -> Array:
    """Moment Gamma that turns the velocity to the target, body frame, (3,) [N m]."""
    a, w = gains.a, plant[W : W + 3]
    axis, _ = line_of_sight(plant, target)
    stiff = -gains.k_c * rotate_inverse(plant[Q : Q + 4], axis)
    gyroscopic = np.array(((a.J3 - a.J2) * w[1] * w[2], (a.J1 - a.J3) * w[0] * w[2], (a.J2 - a.J1) * w[0] * w[1]))
    return np.asarray(stiff - gains.k_d * w + gyroscopic)


@njit(cache=True)
def model(v_b: Array, eta: float, command: Array, gains: LineOfSightGains) -> tuple[Array, Array]:
    """Moment M(u'), (3,) [N m], and its Jacobian by u_bar, (3, 3), in either reading of M_y.

    Args:
        v_b: Velocity relative to the air, body frame, (3,) [m/s].
        eta: sqrt(|v_b|^2 + mu c^2 |w|^2) [m/s].
        command: u', (4,).
        gains: Which airframe and which reading.
    """
    a = gains.a
    M, J = moment(v_b, eta, command, a), moment_jacobian(v_b, eta, command, a)
    if gains.swapped:
        arm, slip = a.Delta_r * a.xi_m / a.xi_f, 0.5 * a.S_ratio * a.C_l * a.xi_f
        total, differ, both, apart = command[0], command[1], command[2], command[3]
        M[1] -= arm * slip * (differ - total) * (both - apart)
        J[1, 0] = -arm * slip * both
        J[1, 1] -= arm * slip * (differ - total)
        J[1, 2] = -arm * slip * total
    return M, J


@njit(cache=True)
def limited_inverse(J: Array, floor: float) -> Array:
    """Inverse by singular values, none counted as less than ``floor`` times the largest, (3, 3)."""
    left, singular, right = np.linalg.svd(J)
    least = max(floor * singular[0], 1e-12)
    inverse = np.zeros((3, 3))
    for k in range(3):
        scale = 1.0 / max(singular[k], least)
        for i in range(3):
            for j in range(3):
                inverse[i, j] += scale * right[k, i] * left[j, k]
    return inverse
