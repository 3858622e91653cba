"""The sensors together tell attitude and velocity better than each alone, and their own biases."""

import numpy as np
import pytest

from sitl.lab.identification import rotations
from sitl.lab.identification.identify_flight import usable_stretches
from sitl.lab.identification.path_reconstruction import reconstructed
from sitl.model.airframe_files import load
from tests.support.lab.identified_flight import flown, read, still_record

COLLAGE = load("collage").parameters


@pytest.mark.long
def test_attitude_and_velocity_are_far_better_than_measured():
    _, flight = flown("collage", 3)
    path = reconstructed(usable_stretches(read("collage", 3), COLLAGE)[0], COLLAGE.g)
    at = np.round((path.stretch.time) / 0.002).astype(int)
    truth = flight.body[at]
    off = np.degrees(rotations.vector_of(rotations.product(path.attitude, rotations.inverse(truth[:, 6:10]))))
    assert off.std() < 0.06  # measured to 0.5 deg
    assert (path.velocity - truth[:, 3:6]).std() < 0.015  # measured to 0.05 m/s
    assert np.abs(path.rates - truth[:, 10:]).max() < 0.03
    assert np.abs((path.rates - truth[:, 10:]).mean(axis=0)).max() < 5e-4  # of a bias of up to 0.02 rad/s


def test_deviations_are_those_of_the_sensors():
    path = reconstructed(usable_stretches(read("collage", 3), COLLAGE)[0], COLLAGE.g)
    found = path.deviations
    assert 0.0045 < found.gyro < 0.0055
    assert 0.27 < found.accelerometer < 0.33
    assert 0.4 < np.degrees(found.attitude) < 0.6
    assert 0.015 < found.position < 0.025
    assert 0.04 < found.velocity < 0.06


def test_a_biased_accelerometer_is_found_out_and_perfect_sensors_do_no_harm():
    record = still_record(12.0)
    record.imu.values[:, 3:] += [0.1, -0.2, 0.15]
    path = reconstructed(usable_stretches(record, COLLAGE)[0], COLLAGE.g)
    assert np.allclose(path.accelerometer_bias, [0.1, -0.2, 0.15], atol=0.01)
    assert np.abs(path.velocity).max() < 0.01
