"""A vehicle's knowledge about its own navigation, from the boot on."""

import math

import pytest

from sitl.model.airframe_files import load
from sitl.sensors.instruments import BAROMETER, GNSS, MAGNETOMETER, MOTION_CAPTURE, OFF, PITOT
from sitl.simulation.avionics import Navigation
from sitl.simulation.navigation_status import EXACT, SILENT_TIME, navigation_status
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start

NOMINAL = load("nominal").parameters
KEEP_STILL = ("aligning: keep still",)


def booted(navigation, *off):
    vehicle = Simulation(NOMINAL, navigation=navigation, aligned=False)
    for instrument in off:
        vehicle.avionics.instruments["failures"][instrument] = OFF
    return vehicle


def status(vehicle, seconds=0.0):
    vehicle.step(seconds)
    return navigation_status(vehicle.avionics, vehicle.periods)


def test_on_the_truth_nothing_is_awaited_or_uncertain():
    now = status(Simulation(NOMINAL, navigation=Navigation.TRUTH, aligned=False), 0.1)
    assert (now.is_sensed, now.is_aligned, now.awaited, now.unfused) == (False, True, (), ())
    assert (now.position_age, now.position_deviation) == (0.0, EXACT)


@pytest.mark.parametrize("navigation", [Navigation.SENSORS, Navigation.MOCAP])
def test_it_aligns_within_three_seconds_of_standing_still(navigation):
    vehicle = booted(navigation)
    assert status(vehicle, 0.5).awaited == KEEP_STILL
    now = status(vehicle, 2.5)
    assert (now.is_aligned, now.awaited, now.unfused) == (True, (), ())
    assert now.position_age < 0.3
    assert 0.0 < now.position_deviation.x < 1.0
    assert 0.0 < now.attitude_deviation.x < 0.1


@pytest.mark.parametrize(
    ("navigation", "off", "awaited"),
    [
        (Navigation.SENSORS, GNSS, "waiting for satellites"),
        (Navigation.SENSORS, MAGNETOMETER, "no magnetometer"),
        (Navigation.SENSORS, BAROMETER, "no barometer"),
        (Navigation.MOCAP, MOTION_CAPTURE, "no motion capture"),
    ],
)
def test_it_says_what_it_waits_for(navigation, off, awaited):
    assert status(booted(navigation, off), 4.0).awaited == (awaited,)


def test_instruments_that_stop_grow_old():
    vehicle = Simulation(NOMINAL, navigation=Navigation.SENSORS, start=Start(up=9.0, airborne=True))
    now = status(vehicle, 1.0)
    assert all(now.aid(instrument).reads for instrument in (GNSS, MAGNETOMETER, BAROMETER, PITOT))
    assert now.aid(MOTION_CAPTURE).read_age == math.inf
    assert 0.0 < now.aid(GNSS).ratio < 1.0
    vehicle.avionics.instruments["failures"][[GNSS, BAROMETER]] = OFF
    now = status(vehicle, SILENT_TIME + 0.4)
    assert not now.aid(GNSS).reads
    assert now.position_age > SILENT_TIME
    assert now.unfused == ("barometer",)
