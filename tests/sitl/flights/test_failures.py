"""Instruments and actuators that fail in flight, on sensors: what the vehicle does, by what it can tell itself."""

import math

import pytest

from protocol.dialect import mavlink
from sitl.autopilot.settings import Settings
from sitl.lab.studies.seeded_flights import STUDY_WORLD
from sitl.model.airframe_files import load
from sitl.sensors.instruments import DELAYED, DRIFTING, GARBAGE, INTERMITTENT, OFF, SCALED, STUCK, TOO_SLOW, WRONG
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings

GYRO, ACCEL, MAG, BARO, GPS, VIO, TUBE = (
    mavlink.FAILURE_UNIT_SENSOR_GYRO,
    mavlink.FAILURE_UNIT_SENSOR_ACCEL,
    mavlink.FAILURE_UNIT_SENSOR_MAG,
    mavlink.FAILURE_UNIT_SENSOR_BARO,
    mavlink.FAILURE_UNIT_SENSOR_GPS,
    mavlink.FAILURE_UNIT_SENSOR_VIO,
    mavlink.FAILURE_UNIT_SENSOR_AIRSPEED,
)
MOTOR = mavlink.FAILURE_UNIT_SYSTEM_MOTOR
BEFORE = 2000  # control periods of hover


def flown(unit, failure, seconds, *, up=20.0, navigation=Navigation.SENSORS, instance=0):
    """A hover in a light wind in which something fails; with how far it then goes."""
    vehicle = Simulation(load("collage").parameters, seed=1, start=Start(up=up, airborne=True), navigation=navigation)
    gusts = 0.5 if navigation is Navigation.SENSORS else 0.0
    air = WorldSettings(wind_speed=4.0 * gusts, wind_direction=90.0, gusts=gusts, battery=1e6)
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(Settings(), vehicle.tuning, air), airborne=True)
    aircraft.advance(BEFORE)
    here, away, texts = vehicle.truth.body.position, 0.0, []
    assert aircraft.failures.inject(unit, failure, instance).accepted
    for _ in range(round(seconds / 0.1)):
        aircraft.advance(50)
        away = max(away, math.dist(vehicle.truth.body.position, here))
        texts += [notice.text for notice in aircraft.autopilot.notices()]
    return aircraft, away, texts


@pytest.mark.long(after=1)
@pytest.mark.parametrize("unit", [MAG, BARO, TUBE])
@pytest.mark.parametrize("failure", [GARBAGE, WRONG, STUCK])
def test_readings_that_are_refused_do_not_move_the_vehicle(unit, failure):
    _, away, texts = flown(unit, failure, 15.0)
    assert away < 1.0
    assert set(texts) <= {"Flying without magnetometer", "Flying without barometer"}


@pytest.mark.long(after=1)
@pytest.mark.parametrize("failure", [WRONG, TOO_SLOW, INTERMITTENT])
def test_a_receiver_that_is_wrong_slow_or_there_at_times_moves_it_little(failure):
    _, away, _ = flown(GPS, failure, 15.0)
    assert away < 1.0


@pytest.mark.long(after=1)
@pytest.mark.parametrize("failure", [OFF, STUCK, GARBAGE, DELAYED])
def test_what_a_receiver_tells_that_cannot_be_used_is_not_used(failure):
    lost, _, _ = flown(GPS, OFF, 3.0)
    aircraft, _, _ = flown(GPS, failure, 3.0)
    assert aircraft.vehicle.estimate.age.position > 2.0
    assert math.dist(aircraft.vehicle.truth.body.position, lost.vehicle.truth.body.position) < 0.5


@pytest.mark.parametrize("failure", [OFF, STUCK, GARBAGE])
def test_without_a_gyroscope_the_motors_are_cut(failure):
    aircraft, _, texts = flown(GYRO, failure, 1.0)
    assert "Motors cut: gyroscope failed" in texts
    assert not aircraft.autopilot.armed


@pytest.mark.parametrize("failure", [STUCK, GARBAGE])
def test_without_an_accelerometer_it_flies_by_its_model_and_lands(failure):
    aircraft, _, texts = flown(ACCEL, failure, 12.0, up=2.0, navigation=Navigation.MOCAP)
    assert texts[0] == "Accelerometer failed: landing"
    assert "Landed" in texts
    assert aircraft.vehicle.crash is None


def test_a_capture_that_leaps_is_not_followed():
    aircraft, away, _ = flown(VIO, WRONG, 3.0, up=2.0, navigation=Navigation.MOCAP)
    assert away < 0.3
    assert aircraft.vehicle.avionics.resets == 0


@pytest.mark.parametrize("failure", [SCALED, DRIFTING])
def test_a_capture_that_lies_is_given_up_and_landed_without(failure):
    aircraft, away, texts = flown(VIO, failure, 13.0, up=3.0, navigation=Navigation.MOCAP)
    assert texts[0] == "No position for 2 s: landing"
    assert "Landed" in texts
    assert away < 3.2
    assert aircraft.vehicle.crash is None


def test_a_motor_that_is_off_is_noticed_and_the_other_is_cut():
    aircraft, _, texts = flown(MOTOR, OFF, 3.5, up=80.0, instance=1)
    assert texts[0].startswith("Motors cut: a motor or an elevon failed")
    assert aircraft.vehicle.truth.actuators.right_motor < 300.0


def test_healthy_instruments_are_not_found_to_fail():
    aircraft, away, texts = flown(MOTOR, 0, 20.0)
    assert away < 1.0
    assert not texts
    assert not aircraft.autopilot.failsafes.is_critical
