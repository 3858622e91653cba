"""From the horizon to now: what the laws are given of a vehicle that is held, and of one that falls."""

import pytest

from sitl.estimation.filter import put_nominal
from sitl.estimation.output_predictor import ACCELERATION_TIME, estimate_now
from sitl.model.quaternions import from_euler, rotate_inverse
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import Inertial
from sitl.storage import value_of
from tests.support.flights.ideal_sensors import NOMINAL, ZERO, aboard

Q = from_euler(0.3, -1.2, 0.8)
TICKS = round(ACCELERATION_TIME / PERIOD)  # in which most of an acceleration is felt


def told(force, ticks=20 * TICKS):
    """The estimate after so many control periods of one specific force, world frame; a bias is known."""
    _, f, _ = aboard()
    bias = Vector(0.1, -0.2, 0.3)
    put_nominal(f, value_of(f.nominal)._replace(attitude=Q, accel_bias=bias, gyro_bias=Vector(0.01, 0.02, 0.03)))
    felt = rotate_inverse(Q, force)
    reading = Inertial(Vector(0.01, 0.02, 0.03), Vector(felt.x + bias.x, felt.y + bias.y, felt.z + bias.z))
    for period in range(1, ticks + 1):
        estimate = estimate_now(f, reading, period)
    return estimate


def test_what_is_held_up_by_its_weight_does_not_accelerate_and_what_falls_does():
    held = told(Vector(0.0, 0.0, NOMINAL.g))
    assert held.acceleration == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert held.rates == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert told(ZERO).acceleration == pytest.approx((0.0, 0.0, -NOMINAL.g), rel=1e-6)
    assert told(Vector(1.0, -2.0, NOMINAL.g + 3.0)).acceleration == pytest.approx((1.0, -2.0, 3.0), rel=1e-6)


def test_an_acceleration_is_felt_within_its_time():
    begun = told(Vector(1.0, 0.0, NOMINAL.g), ticks=TICKS)
    assert begun.acceleration.x == pytest.approx(0.632, abs=0.01)
