"""Readings of the sensors, and the truth as an estimate."""

import math

import numpy as np
import pytest

from sitl.estimation.sensing import Normals, SensorNoise, observe, read, specific_force
from sitl.model.airframe_files import load
from sitl.model.ground import LEVEL_GROUND, is_touching
from sitl.model.quaternions import hover, rotate_inverse
from sitl.model.vectors import Vector, subtract
from tests.support.flights.plant_flight import plant, standing_height

A = load("nominal").parameters
CALM, QUIET = Vector(0.0, 0.0, 0.0), Normals(0.0, 0.0, 0.0, 0.0, 0.0)
SENSORS = SensorNoise(accelerometer=0.3, velocity=0.03, pitot=0.2, has_pitot=True)


def test_an_accelerometer_at_rest_in_the_hover_reads_the_lift_and_one_in_free_fall_nothing():
    assert specific_force(plant(), CALM, A) == pytest.approx((0.0, 0.0, 0.0))
    omega = math.sqrt(0.5 * A.m * A.g / (1.0 - A.S_ratio * A.C_d0) / A.k_f)
    assert specific_force(plant(u=(omega, omega, 0.0, 0.0)), CALM, A) == pytest.approx((A.g, 0.0, 0.0))


def test_without_noise_the_readings_are_the_truth():
    wind = Vector(2.0, -1.0, 0.5)
    x = plant(v=(8.0, 1.0, 0.3), q=hover(0.4), w=(0.1, 0.2, 0.3), u=(600.0, 650.0, 0.1, -0.1))
    seen = read(x, wind, QUIET, SENSORS, A)
    assert seen.velocity == x.body.velocity
    assert seen.normal_force == specific_force(x, wind, A).z
    assert seen.airspeed == rotate_inverse(x.body.attitude, subtract(x.body.velocity, wind)).x
    assert seen.has_airspeed


def test_noise_is_each_sensor_s_own():
    quiet = read(plant(), CALM, QUIET, SENSORS, A)
    noisy = read(plant(), CALM, Normals(1.0, -2.0, 3.0, -4.0, 5.0), SENSORS, A)
    assert np.subtract(noisy.velocity, quiet.velocity) == pytest.approx([0.03, -0.06, 0.09])
    assert noisy.normal_force - quiet.normal_force == pytest.approx(-1.2)
    assert noisy.airspeed - quiet.airspeed == pytest.approx(1.0)
    assert not read(plant(), CALM, QUIET, SENSORS._replace(has_pitot=False), A).has_airspeed


@pytest.mark.parametrize(("height", "on_ground"), [(50.0, False), (standing_height(A) + 1e-3, True)])
def test_the_truth_is_fresh_and_knows_everything_but_the_wind(height, on_ground):
    x, acceleration, wind = (
        plant((1.0, 2.0, height), u=(600.0, 650.0, 0.1, -0.1)),
        Vector(0.1, 0.2, 0.3),
        Vector(1, 2, 3),
    )
    seen = observe(x, acceleration, wind, is_touching(x, LEVEL_GROUND, A))
    assert (seen.position, seen.velocity, seen.attitude, seen.rates) == x.body
    assert (seen.acceleration, seen.wind, seen.actuators) == (acceleration, wind, x.actuators)
    assert seen.on_ground is on_ground
    assert set(seen.age) == {0.0}
