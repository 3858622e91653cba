"""A cruise as a navigation filter believes it, and readings of every instrument that it makes of it."""

import numpy as np

from sitl.estimation import air_readings, observations
from sitl.estimation.air import feel_for_long
from sitl.estimation.filter import Step, put_nominal
from sitl.estimation.nominal_state import (
    ACCEL_BIAS_ERROR,
    ATTITUDE_ERROR,
    BAROMETER_DRIFT_ERROR,
    ERRORS,
    GNSS_DRIFT_ERROR,
    MAGNETIC_BIAS_ERROR,
    MISALIGNMENT_ERROR,
    POSITION_ERROR,
    STATIC_PORT_ERROR,
    TUBE_BIAS_ERROR,
    TUBE_SPEED_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
    WING_ERROR,
    NominalState,
)
from sitl.estimation.strapdown import no_increment
from sitl.model.aerodynamics import wrench
from sitl.model.quaternions import from_euler, multiply, rotate, rotate_inverse, small_rotation
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, cross, subtract
from sitl.sensors.instruments import (
    ATTITUDE_VARIANCE,
    FIRST_DELAYED,
    HAS_ATTITUDE,
    MOTION_CAPTURE,
    POSITION_VARIANCE,
    READING_SIZE,
)
from sitl.storage import value_of
from tests.support.flights.ideal_sensors import NOMINAL, SHIPPED, WANDERING, aboard

_BELIEVED = NominalState(
    position=Vector(10.0, -20.0, 30.0),
    velocity=Vector(13.0, 3.0, -0.5),
    attitude=from_euler(0.2, -0.2, 0.3),
    gyro_bias=Vector(0.01, -0.02, 0.03),
    accel_bias=Vector(0.1, 0.2, -0.15),
    wind=Vector(-1.0, 2.0, 0.3),
    misalignment=Vector(0.01, -0.005, 0.02),
    magnetic_bias=Vector(1e-6, -2e-6, 1.5e-6),
    gnss_drift=Vector(0.4, -0.3, 0.6),
    barometer_drift=0.2,
    steady_wind=Vector(-1.5, 1.0, 0.1),
    tube_bias=0.1,
    tube_speed=0.0,
    static_port=0.0,
)
RATES = Vector(0.2, -0.3, 0.1)
EARTH = Vector(SHIPPED.magnetometer.field_north, SHIPPED.magnetometer.field_west, SHIPPED.magnetometer.field_up)
AIRSPEED = rotate_inverse(_BELIEVED.attitude, subtract(_BELIEVED.velocity, _BELIEVED.wind))
CRUISE = _BELIEVED._replace(tube_speed=AIRSPEED.x)
ACTUATORS = Actuators(520.0, 540.0, 0.05, -0.02)
PERIODS = 100


def reading_of(*parts):
    reading = np.zeros(READING_SIZE)
    for first, part in parts:
        reading[first : first + np.size(part)] = part
    return reading


def pose_reading():
    q = multiply(CRUISE.attitude, small_rotation(CRUISE.misalignment))
    return reading_of(
        (0, CRUISE.position), (3, multiply(q, small_rotation(Vector(0.002, 0.001, -0.001)))),
        (POSITION_VARIANCE, 1e-4), (ATTITUDE_VARIANCE, 1e-4), (HAS_ATTITUDE, 1.0),
    )  # fmt: skip


def wing_step():
    v_b = AIRSPEED
    F, _ = wrench(v_b, RATES, ACTUATORS, NOMINAL)
    zero = Vector(0.0, 0.0, 0.0)
    force = Vector(0.0, 0.0, F.z / NOMINAL.m + CRUISE.accel_bias.z + 0.1)
    return Step(no_increment(), zero, zero, force, add(RATES, CRUISE.gyro_bias), ACTUATORS)


def observe_tube(f, i, speed):
    air_readings.observe_airspeed(f, i, reading_of((0, speed)), PERIODS, wing_step())


_ANTENNA = WANDERING.mounting.antenna
FIX = reading_of(
    (0, add(add(CRUISE.position, CRUISE.gnss_drift), rotate(CRUISE.attitude, _ANTENNA))),
    (3, add(CRUISE.velocity, rotate(CRUISE.attitude, cross(RATES, _ANTENNA)))),
)
FIELD = reading_of((0, add(rotate_inverse(CRUISE.attitude, EARTH), CRUISE.magnetic_bias)))
OBSERVED = {
    "satellites": lambda f, i: observations.observe_satellites(f, i, FIX, 0.0, RATES, PERIODS),
    "field": lambda f, i: observations.observe_field(f, i, FIELD, 0.0, RATES, PERIODS),
    "height": lambda f, i: observations.observe_height(f, i, reading_of((0, 30.3)), 0.0, PERIODS),
    "pose": lambda f, _: observations.observe_pose(
        f, MOTION_CAPTURE - FIRST_DELAYED, pose_reading(), 0.0, RATES, PERIODS
    ),
    "airspeed": lambda f, i: observe_tube(f, i, AIRSPEED.x + 0.2),
    "wing": lambda f, _: air_readings.observe_wing(f, wing_step(), True, 0.0),
}
BY = {  # what each reading tells of
    "satellites": (POSITION_ERROR, ATTITUDE_ERROR, GNSS_DRIFT_ERROR, VELOCITY_ERROR),
    "field": (ATTITUDE_ERROR, MAGNETIC_BIAS_ERROR),
    "height": (POSITION_ERROR, BAROMETER_DRIFT_ERROR, STATIC_PORT_ERROR),
    "pose": (POSITION_ERROR, ATTITUDE_ERROR, MISALIGNMENT_ERROR),
    "airspeed": (TUBE_BIAS_ERROR, TUBE_SPEED_ERROR),
    "wing": (VELOCITY_ERROR, WIND_ERROR, ATTITUDE_ERROR, ACCEL_BIAS_ERROR),
}
FIRSTS = (*range(0, 21, 3), TUBE_BIAS_ERROR, TUBE_SPEED_ERROR, WING_ERROR, MISALIGNMENT_ERROR, MAGNETIC_BIAS_ERROR,
          GNSS_DRIFT_ERROR, BAROMETER_DRIFT_ERROR, STATIC_PORT_ERROR)  # fmt: skip
AIR = slice(WIND_ERROR, WIND_ERROR + 3)
# A turn of milliradians is taken for small; what the airspeed does to the height is told by its share alone, and what
# the wind along the span does to the wing is not told at all.
TOLERANCE = {"pose": 0.02, "wing": 0.12, "height": 0.01}


def fused(name, belief, variances=None):
    """The errors' change of a belief by a reading, with the covariance before and after."""
    i, f, _ = aboard(WANDERING, assumed=WANDERING)
    P = f["covariance"]
    P[:] = np.diag(np.full(ERRORS, 1e-2) if variances is None else variances)
    P[MAGNETIC_BIAS_ERROR:GNSS_DRIFT_ERROR, MAGNETIC_BIAS_ERROR:GNSS_DRIFT_ERROR] *= 1e-10
    P[STATIC_PORT_ERROR, STATIC_PORT_ERROR] *= 1e-2
    put_nominal(f, belief)
    feel_for_long(f)
    before = P.copy()
    f["on_ground"] = False
    OBSERVED[name](f, i)
    return value_of(f.nominal), before, P, f


def filter_with(P=1e-2):
    i, f, _ = aboard(WANDERING, assumed=WANDERING)
    f["covariance"][:] = P * np.eye(ERRORS)
    put_nominal(f, CRUISE)
    return i, f
