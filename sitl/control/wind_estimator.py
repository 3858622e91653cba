r"""Wind estimator: an extended Kalman filter on the vehicle's own sensors.

Flying forward in an unknown wind fails, in gusts sooner than in a steady wind, because the incidence is mistaken. The
wing is the sensor: the normal specific force that the accelerometer feels tells the velocity of the air across it,

.. math::
    m f_z = -\sum_i E_i - \tfrac12 \rho S \eta C_l v_{b,z},

a pitot tube the velocity along the nose, and as the body turns the two see every axis of a wind that varies slowly.
The filter has three states, the wind as a random walk; ground velocity and attitude come from motion capture or
satellites. Wind along the span makes no force in the model: the estimate along that axis keeps its last value.
"""

import math
from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.estimate import Estimate, Readings
from sitl.model.aerodynamics import normal_force, slopes, thrusts
from sitl.model.airframe import STALL, Airframe
from sitl.model.arithmetic import decay
from sitl.model.quaternions import rotate, rotate_inverse, x_axis
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add_scaled, dot, scaled, subtract

MIN_SLOPE_SPEED = 0.1  # of the slope of the normal force by the wind [m/s]


class WindGains(NamedTuple):
    """Tuning of the filter."""

    walk: float  # how fast the wind may change, per axis [m/s per sqrt(s)]
    return_time: float  # without news the estimate fades to calm in this time [s]
    normal_noise: float  # what the wing's reading is trusted to [m/s2 sqrt(s)]
    pitot_noise: float  # what the pitot's is trusted to [m/s sqrt(s)]
    axial_time: float  # without a tube the wind along the nose fades to calm in this time [s]
    min_pitot: float  # the tube reads nothing below this [m/s]
    max_deviation: float  # standard deviation at the start, and what it grows to at most [m/s]


class Covariance(NamedTuple):
    """Of the wind, symmetric, world NWU [m2/s2]."""

    xx: float
    xy: float
    xz: float
    yy: float
    yz: float
    zz: float


class WindState(NamedTuple):
    """State of the filter."""

    wind: Vector  # velocity of the air, world NWU [m/s]
    covariance: Covariance


@kernel
def start(gains: WindGains) -> WindState:
    """Nothing is known: calm, with the greatest covariance."""
    most = gains.max_deviation * gains.max_deviation
    return WindState(Vector(0.0, 0.0, 0.0), Covariance(xx=most, xy=0.0, xz=0.0, yy=most, yz=0.0, zz=most))


@kernel
def update(
    estimate: Estimate, readings: Readings, gains: WindGains, a: Airframe, state: WindState, dt: float
) -> WindState:
    """One tick of the filter.

    Args:
        estimate: Of attitude, rates and actuators; its wind is not looked at.
        readings: Of the sensors.
        gains: Tuning.
        a: The airframe as the vehicle knows it.
        state: State of the filter.
        dt: Tick [s].
    """
    q, tube = estimate.attitude, readings.has_airspeed
    state = _predicted(state, gains, dt)
    v_b = rotate_inverse(q, subtract(readings.velocity, state.wind))
    expected = normal_force(v_b, estimate.rates, estimate.actuators, a)
    lightness = 1.0 / a.m
    slope = normal_slope(v_b, estimate.actuators, a)
    # The wing tells the product of speed and incidence: unchecked by a tube, gusts would be taken for speed.
    slope = Vector(lightness * (slope.x if tube else 0.0), lightness * slope.y, lightness * slope.z)
    noise = gains.normal_noise * gains.normal_noise / dt
    state = _corrected(state, rotate(q, slope), readings.normal_force - lightness * expected, noise)
    nose = x_axis(q)
    if not tube:
        lost = 1.0 - decay(dt / gains.axial_time)
        state = WindState(add_scaled(state.wind, nose, -lost * dot(state.wind, nose)), state.covariance)
    elif readings.airspeed > gains.min_pitot:
        along = dot(subtract(readings.velocity, state.wind), nose)
        noise = gains.pitot_noise * gains.pitot_noise / dt
        state = _corrected(state, scaled(nose, -1.0), readings.airspeed - along, noise)
    return _bounded(state, gains.max_deviation * gains.max_deviation)


@kernel
def _predicted(state: WindState, gains: WindGains, dt: float) -> WindState:
    """The random walk over a tick."""
    C, fresh = state.covariance, gains.walk * gains.walk * dt
    spread = Covariance(xx=C.xx + fresh, xy=C.xy, xz=C.xz, yy=C.yy + fresh, yz=C.yz, zz=C.zz + fresh)
    return WindState(scaled(state.wind, decay(dt / gains.return_time)), spread)


@kernel
def normal_slope(v_b: Vector, actuators: Actuators, a: Airframe) -> Vector:
    """Derivative of the force along z_b by the wind in the body frame [N s/m].

    Args:
        v_b: Velocity through the air, body frame [m/s].
        actuators: As they are believed to be.
        a: The airframe.
    """
    if a.aerodynamics == STALL:
        T1, T2 = thrusts(actuators, v_b.x, a)
        normal = slopes(v_b, T1, T2, a).normal
        square = dot(v_b, v_b) + MIN_SLOPE_SPEED * MIN_SLOPE_SPEED
        return Vector(normal * v_b.z * v_b.x / square, 0.0, normal)
    both = actuators.left_elevon + actuators.right_elevon
    half = 0.5 * a.rho * a.S
    eta = math.sqrt(v_b.x * v_b.x + v_b.y * v_b.y + v_b.z * v_b.z + MIN_SLOPE_SPEED * MIN_SLOPE_SPEED)
    tilt = 0.5 * a.C_l * a.xi_f * both
    across = (tilt * v_b.x + a.C_l * v_b.z) / eta
    return Vector(half * (across * v_b.x + eta * tilt), half * across * v_b.y, half * (across * v_b.z + eta * a.C_l))


@kernel
def _corrected(state: WindState, H: Vector, innovation: float, noise: float) -> WindState:
    """Kalman update by one scalar reading with row ``H`` and variance ``noise``."""
    C = state.covariance
    CH = Vector(
        C.xx * H.x + C.xy * H.y + C.xz * H.z,
        C.xy * H.x + C.yy * H.y + C.yz * H.z,
        C.xz * H.x + C.yz * H.y + C.zz * H.z,
    )
    K = scaled(CH, 1.0 / (dot(H, CH) + noise))
    return WindState(
        add_scaled(state.wind, K, innovation),
        Covariance(
            xx=C.xx - K.x * CH.x,
            xy=C.xy - K.x * CH.y,
            xz=C.xz - K.x * CH.z,
            yy=C.yy - K.y * CH.y,
            yz=C.yz - K.y * CH.z,
            zz=C.zz - K.z * CH.z,
        ),
    )


@kernel
def _bounded(state: WindState, most: float) -> WindState:
    C = state.covariance
    return WindState(
        state.wind, Covariance(xx=min(C.xx, most), xy=C.xy, xz=C.xz, yy=min(C.yy, most), yz=C.yz, zz=min(C.zz, most))
    )
