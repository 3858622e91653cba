r"""What the vehicle knows of the air: a wind estimator on its own sensors.

Flying forward in an unknown wind fails, in gusts sooner than in a steady wind, because the incidence is mistaken. The
wing is the sensor: the normal specific force that the accelerometer feels tells the velocity of the air across it,

.. math::
    m f_z = -\sum_i E_i - \tfrac12 \rho S \eta C_l v_{b,z},

a pitot tube that along it, and as the body turns the two see every axis of a wind that varies slowly. An extended
Kalman filter of three states (the wind, a random walk) puts them together; ground velocity and attitude come
from motion capture or satellites. Nothing in the model tells the wind along the span, which makes no force: that
axis keeps what was last seen of it.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.kernels.aerodynamics import wrench
from sitl.model.airframe import Airframe, Array
from sitl.kernels.quaternion import rotate, rotate_inverse
from sitl.kernels.state import ACTUATOR, Q, V, W

# The estimator's state.
WIND = 0  # world NWU, 3 entries [m/s]
COVARIANCE = 3  # 3 by 3, row by row, 9 entries [m2/s2]
SIZE = 12


class AirSensors(NamedTuple):
    """Noise of the simulated sensors, one standard deviation per reading (one a tick)."""

    accelerometer: float  # [m/s2]
    velocity: float  # of motion capture or satellites, per axis [m/s]
    pitot: float  # [m/s]
    has_pitot: bool


class AirGains(NamedTuple):
    """Tuning of the filter."""

    walk: float  # how fast the wind may change, per axis [m/s per sqrt(s)]
    return_time: float  # without news the estimate fades to calm in this time [s]
    normal_noise: float  # what the wing's reading is trusted to [m/s2 sqrt(s)]
    pitot_noise: float  # what the pitot's is trusted to [m/s sqrt(s)]
    axial_time: float  # without a tube the wind along the nose fades to calm in this time [s]
    pitot_from: float  # the tube reads nothing below this [m/s]
    most: float  # standard deviation at the start, and what it grows to at most [m/s]


@njit(cache=True)
def reset(air: Array, gains: AirGains) -> None:
    """Nothing is known: calm, with the greatest covariance."""
    air[:] = 0.0
    for i in range(3):
        air[COVARIANCE + 4 * i] = gains.most**2


@njit(cache=True)
def specific_force(plant: Array, wind: Array, a: Airframe) -> Array:
    """What an ideal accelerometer at the centre of mass reads off the ground, body frame, (3,) [m/s2]."""
    v_b = rotate_inverse(plant[Q : Q + 4], plant[V : V + 3] - wind)
    p, q, r = plant[W], plant[W + 1], plant[W + 2]
    w1, w2, d1, d2 = plant[ACTUATOR], plant[ACTUATOR + 1], plant[ACTUATOR + 2], plant[ACTUATOR + 3]
    Fx, Fy, Fz, _, _, _ = wrench(v_b[0], v_b[1], v_b[2], p, q, r, w1, w2, d1, d2, a)
    return np.array((Fx / a.m, Fy / a.m, Fz / a.m))


@njit(cache=True)
def update(
    plant: Array, velocity: Array, normal: float, pitot: float, air: Array, gains: AirGains, a: Airframe, dt: float
) -> None:
    """One tick of the filter, its state changed in place.

    Args:
        plant: Attitude, rates and actuators are read from it.
        velocity: Measured, world, (3,) [m/s].
        normal: Specific force along z_b [m/s2].
        pitot: Airspeed along x_b [m/s]; NaN without a tube.
        air: State of the filter, (SIZE,).
        gains: Tuning.
        a: The airframe as the vehicle knows it.
        dt: Tick [s].
    """
    wind, C = air[WIND : WIND + 3], air[COVARIANCE : COVARIANCE + 9].reshape(3, 3)
    wind *= math.exp(-dt / gains.return_time)
    for i in range(3):
        C[i, i] += gains.walk**2 * dt
    q = plant[Q : Q + 4]
    v_b = rotate_inverse(q, velocity - wind)
    p, r_q, r = plant[W], plant[W + 1], plant[W + 2]
    w1, w2, d1, d2 = plant[ACTUATOR], plant[ACTUATOR + 1], plant[ACTUATOR + 2], plant[ACTUATOR + 3]
    _, _, Fz, _, _, _ = wrench(v_b[0], v_b[1], v_b[2], p, r_q, r, w1, w2, d1, d2, a)
    half, eta = 0.5 * a.rho * a.S, math.sqrt(v_b[0] ** 2 + v_b[1] ** 2 + v_b[2] ** 2 + 0.01)
    tilt = 0.5 * a.C_l * a.xi_f * (d1 + d2)
    across = tilt * v_b[0] + a.C_l * v_b[2]
    slope = np.array(
        (across * v_b[0] / eta + eta * tilt, across * v_b[1] / eta, across * v_b[2] / eta + eta * a.C_l)
    ) * (half / a.m)  # of normal by the wind in the body frame
    if math.isnan(pitot):
        # The wing tells the product of speed and incidence: unchecked by a tube, gusts would be taken for speed.
        slope[0] = 0.0
    _correct(wind, C, rotate(q, slope), normal - Fz / a.m, gains.normal_noise**2 / dt)
    if math.isnan(pitot):
        nose = rotate(q, np.array((1.0, 0.0, 0.0)))
        along = wind[0] * nose[0] + wind[1] * nose[1] + wind[2] * nose[2]
        wind -= (1.0 - math.exp(-dt / gains.axial_time)) * along * nose
    if pitot > gains.pitot_from:
        v_b = rotate_inverse(q, velocity - wind)
        _correct(wind, C, rotate(q, np.array((-1.0, 0.0, 0.0))), pitot - v_b[0], gains.pitot_noise**2 / dt)
    for i in range(3):
        C[i, i] = min(C[i, i], gains.most**2)


@njit(cache=True)
def _correct(wind: Array, C: Array, H: Array, innovation: float, noise: float) -> None:
    """Kalman update by one scalar reading with row ``H``, in place."""
    CH = np.empty(3)
    for i in range(3):
        CH[i] = C[i, 0] * H[0] + C[i, 1] * H[1] + C[i, 2] * H[2]
    s = H[0] * CH[0] + H[1] * CH[1] + H[2] * CH[2] + noise
    for i in range(3):
        wind[i] += CH[i] / s * innovation
    for i in range(3):
        for j in range(3):
            C[i, j] -= CH[i] * CH[j] / s
