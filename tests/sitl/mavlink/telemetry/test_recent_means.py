"""Means of what a vehicle read since its autopilot's last tick, as telemetry tells them."""

import numpy as np
import pytest

from sitl.mavlink.telemetry.recent_means import inertial_mean
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import ACCELEROMETER, WRONG
from sitl.simulation.avionics import Navigation
from tests.support.flights.sensed_flights import SENSORS, hovering

COUNT = 10
QUIETER = 0.3  # share of a propeller's vibration that a mean over 20 ms may keep


def read(vehicle, periods):
    """Readings (n, 6) of periods flown one by one."""
    rows = []
    for _ in range(periods):
        vehicle.step(PERIOD)
        rates, force = vehicle.avionics.instruments.inertial.item()
        rows.append((*rates, *force))
    return np.array(rows)


def mean(vehicle):
    return inertial_mean(vehicle.avionics, vehicle.periods, COUNT)


def test_they_are_of_the_last_periods_and_as_old_as_their_middle():
    vehicle = hovering(SENSORS)
    vehicle.step(0.5)
    rows, found = read(vehicle, COUNT), mean(vehicle)
    assert (*found.reading.rates, *found.reading.force) == pytest.approx(rows.mean(axis=0), abs=1e-12)
    assert found.age == pytest.approx(0.5 * COUNT * PERIOD)


def test_vibration_does_not_fold_into_what_is_seldom_read():
    vehicle = hovering(SENSORS)
    vehicle.step(2.0)
    sampled, meant = [], []
    for _ in range(100):
        sampled.append(read(vehicle, COUNT)[-1])
        found = mean(vehicle).reading
        meant.append((*found.rates, *found.force))
    across = slice(4, 6)  # specific force in the discs' plane
    assert np.std(meant, axis=0)[across].max() < QUIETER * np.std(sampled, axis=0)[across].min()


def test_a_broken_instrument_is_told_as_it_reads():
    vehicle = hovering(SENSORS)
    vehicle.step(0.5)
    vehicle.avionics.instruments.failures[ACCELEROMETER] = WRONG
    rows, found = read(vehicle, COUNT), mean(vehicle)
    assert (*found.reading.rates, *found.reading.force) == pytest.approx(rows[-1])
    assert found.age == 0.0


def test_a_vehicle_that_sees_the_truth_reads_nothing():
    assert mean(hovering(Navigation.TRUTH)) is None
