r"""Attitude law: a commanded attitude and a force along the nose, followed by the zero-moment law's attitude loop.

The position loop is gone. In its place a reference (q_r, omega_r) goes from where the vehicle is to the command q_c as
a critically damped second-order system of bandwidth :math:`\omega_n`, its acceleration and rate bounded by what the
elevons can follow; omega_c is the command's own body rate:

.. math::
    \dot\omega_r = 2 \omega_n^2 \, \mathrm{sgn}(\eta) \epsilon + 2 \omega_n (R \omega_c - \omega_r),
    \quad (\eta, \epsilon) = q_r^{-1} \otimes q_c

The attitude loop makes q follow q_r with omega_r and its derivative fed forward. What the air stream does to the wing
is in no model of the hover: a disturbance observer finds it, so that a tilt is held in a wind and at speed.

With q_e = q_r^{-1} q and omega_e the rate of one against the other, the loop makes V of :func:`lyapunov` fall at
2 zeta / lambda |omega_e|^2 as long as the allocation gives the torque and the disturbance is the one observed.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.model.airframe import Airframe, Array
from sitl.kernels.quaternion import conjugate, from_rotation_vector, multiply, normalised, rotate, rotate_inverse
from sitl.kernels.state import Q, V, W
from sitl.laws import moment_observer
from sitl.laws.hover_zero_moment import ZeroMomentGains, attitude_torque, realise

RATE, FORCE, OBSERVER = 4, 7, 8  # the law's state: q_r, omega_r, the force, the observer's
SIZE = 8 + moment_observer.SIZE


class AttitudeGains(NamedTuple):
    """Gains beside those of the attitude loop."""

    bandwidth: float  # of the reference [rad/s]
    most_rate: float  # of the reference [rad/s]
    most_acceleration: float  # of the reference [rad/s2]
    force_rate: float  # bandwidth of the force [1/s]
    observer: float  # bandwidth of the moment's disturbance observer [rad/s]; 0: none


@njit(cache=True)
def reset(plant: Array, force: float, law: Array, loop: ZeroMomentGains, a: Airframe) -> None:
    """Jump map on entering the law: the reference is where the vehicle is, the force what it gives.

    Args:
        plant: Plant state.
        force: Along the nose, given now [N].
        law: Receives the law's state, (SIZE,).
        loop: Gains of the attitude loop, with the bounds of the force.
        a: The airframe.
    """
    law[:RATE] = plant[Q : Q + 4]
    law[RATE:FORCE] = plant[W : W + 3]
    law[FORCE] = min(max(force, loop.f_min), loop.f_max)
    moment_observer.reset(plant, law[OBSERVER:], a)


@njit(cache=True)
def control(
    plant: Array,
    law: Array,
    attitude: Array,
    rates: Array,
    force: float,
    gains: AttitudeGains,
    loop: ZeroMomentGains,
    a: Airframe,
    dt: float,
    u: Array,
) -> None:
    """One tick of the law: virtual commands into ``u`` (4,), the law's state advanced by ``dt``.

    Args:
        plant: Plant state.
        law: The law's state, (SIZE,), changed in place.
        attitude: q_c, body FLU in world NWU, (4,).
        rates: The command's own rate, in its body frame, (3,) [rad/s].
        force: Wanted along the nose [N].
        gains: Gains of the law.
        loop: Gains of the attitude loop.
        a: The airframe.
        dt: Tick [s].
        u: Receives the commands that ``loop.M_pinv`` and ``loop.u_bar`` speak of.
    """
    q_r, w_r = law[:RATE], law[RATE:FORCE]
    w_r_dot = _reference_acceleration(q_r, w_r, attitude, rates, gains)
    torque = attitude_torque(plant[Q : Q + 4], plant[W : W + 3], q_r, w_r, w_r_dot, loop)
    # As if the air went along: what the stream does is then part of what is observed.
    torque -= moment_observer.update(plant, plant[V : V + 3], law[OBSERVER:], gains.observer, a, dt)
    realise(torque, law[FORCE], loop, u)
    law[:RATE] = normalised(multiply(q_r, from_rotation_vector(dt * w_r)))
    law[RATE:FORCE] = _shortened(w_r + dt * w_r_dot, gains.most_rate)
    step = min(gains.force_rate * dt, 1.0) * (force - law[FORCE])
    law[FORCE] = min(max(law[FORCE] + step, loop.f_min), loop.f_max)


@njit(cache=True)
def lyapunov(plant: Array, law: Array, loop: ZeroMomentGains) -> float:
    r"""V = 4 (1 - |eta|) + |omega_e|^2 / (2 lambda^2) of the error against the reference [rad2].

    For a small error by an angle theta it is (theta^2 + |omega_e|^2 / lambda^2) / 2.
    """
    off = multiply(conjugate(law[:RATE]), plant[Q : Q + 4])
    rate = plant[W : W + 3] - rotate_inverse(off, law[RATE:FORCE])
    return float(4.0 * (1.0 - abs(off[0])) + 0.5 * np.dot(rate, rate) / loop.lam**2)


@njit(cache=True)
def _reference_acceleration(q_r: Array, w_r: Array, attitude: Array, rates: Array, gains: AttitudeGains) -> Array:
    off = multiply(conjugate(q_r), attitude)
    sign = 1.0 if off[0] >= 0.0 else -1.0
    pull = 2.0 * gains.bandwidth**2 * sign * off[1:] + 2.0 * gains.bandwidth * (rotate(off, rates) - w_r)
    return _shortened(pull, gains.most_acceleration)


@njit(cache=True)
def _shortened(x: Array, most: float) -> Array:
    length = np.sqrt(np.dot(x, x))
    return x if length <= most else x * (most / length)
