"""MAV_CMD_INJECT_FAILURE as a COMMAND_LONG: what is answered, what fails, and what heals.

https://mavlink.io/en/messages/common.html#MAV_CMD_INJECT_FAILURE
"""

import math

import pytest

from protocol.dialect import mavlink
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.model.airframe_files import load
from sitl.sensors.instruments import GNSS, OFF, STUCK, WRONG
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.injected_failures import LEFT_AFTER_SAG, LOST_CELL, MISREAD
from sitl.vehicle.parameters import Configuration, WorldSettings
from tests.support.vehicle.fake_station import FRAME, FakeStation

INJECT = mavlink.MAV_CMD_INJECT_FAILURE
ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3
GYRO, MAG, GPS, VIO = (
    mavlink.FAILURE_UNIT_SENSOR_GYRO,
    mavlink.FAILURE_UNIT_SENSOR_MAG,
    mavlink.FAILURE_UNIT_SENSOR_GPS,
    mavlink.FAILURE_UNIT_SENSOR_VIO,
)
BATTERY, MOTOR, SERVO, LINK = (
    mavlink.FAILURE_UNIT_SYSTEM_BATTERY,
    mavlink.FAILURE_UNIT_SYSTEM_MOTOR,
    mavlink.FAILURE_UNIT_SYSTEM_SERVO,
    mavlink.FAILURE_UNIT_SYSTEM_MAVLINK_SIGNAL,
)


def station(folder, navigation=Navigation.TRUTH, *, enabled=True, up=10.0):
    vehicle = Simulation(load("physical").parameters, start=Start(up=up, airborne=True), navigation=navigation)
    configuration = Configuration(Settings(failure_injection=int(enabled)), vehicle.tuning, WorldSettings())
    aircraft = Aircraft(vehicle, World(FRAME, ARENAS["open"]), configuration, airborne=True)
    return FakeStation.with_vehicle(folder, aircraft=aircraft)


def test_nothing_fails_unless_the_parameter_allows_it(tmp_path):
    ground = station(tmp_path, enabled=False)
    assert ground.command(INJECT, MOTOR, OFF, 1) == DENIED
    assert "set SYS_FAILURE_EN to 1" in ground.texts()
    ground.set_parameter("SYS_FAILURE_EN", 1)
    assert ground.command(INJECT, MOTOR, STUCK, 1) == ACCEPTED


@pytest.mark.parametrize(
    ("params", "result", "text"),
    [
        ((MOTOR, OFF, 3), DENIED, "there is no motor 3"),
        ((MOTOR, OFF, -1), DENIED, "there is no motor -1"),
        ((BATTERY, OFF, 2), DENIED, "there is no battery 2"),
        ((MOTOR, 8), DENIED, "8 is not a FAILURE_TYPE"),
        ((55, OFF), DENIED, "55 is not a FAILURE_UNIT"),
        ((math.nan, OFF), DENIED, "param1 is nan, not a whole number from 0 to 65535 (FAILURE_UNIT)"),
        ((MOTOR, math.inf), DENIED, "param2 is inf, not a whole number from 0 to 255 (FAILURE_TYPE)"),
        ((MOTOR, 1.5), DENIED, "param2 is 1.5, not a whole number"),
        ((MOTOR, WRONG), UNSUPPORTED, "motor wrong"),
        ((BATTERY, STUCK), UNSUPPORTED, "battery stuck"),
        ((LINK, STUCK), UNSUPPORTED, "link stuck"),
        ((GYRO, OFF), UNSUPPORTED, "navigation by truth does not read the gyroscope"),
        ((mavlink.FAILURE_UNIT_SENSOR_OPTICAL_FLOW, OFF), UNSUPPORTED, "no optical flow"),
        ((mavlink.FAILURE_UNIT_SYSTEM_RC_SIGNAL, OFF), UNSUPPORTED, "no radio control"),
    ],
)
def test_what_cannot_fail_is_refused_with_the_reason(tmp_path, params, result, text):
    ground = station(tmp_path)
    assert ground.command(INJECT, *params) == result
    assert text in ground.texts()
    assert ground.vehicle.faults == type(ground.vehicle.faults)()


def test_instances_are_left_and_right_and_none_is_both(tmp_path):
    ground = station(tmp_path)
    assert ground.command(INJECT, SERVO, STUCK, 2) == ACCEPTED
    assert (ground.vehicle.faults.left_elevon, ground.vehicle.faults.right_elevon) == (0, STUCK)
    assert ground.command(INJECT, SERVO, 0, 0) == ACCEPTED
    assert ground.command(INJECT, MOTOR, STUCK) == ACCEPTED
    assert ground.vehicle.faults[:4] == (STUCK, STUCK, 0, 0)
    ground.advance(0.1)
    assert "Healed: elevons" in ground.texts()
    assert "Failure injected: motors stuck" in ground.texts()


def test_an_instrument_fails_where_it_is_read(tmp_path):
    ground = station(tmp_path / "outdoors", Navigation.SENSORS)
    assert ground.command(INJECT, GPS, OFF) == ACCEPTED
    assert ground.vehicle.avionics.instruments["failures"][GNSS] == OFF
    assert ground.command(INJECT, VIO, OFF) == UNSUPPORTED
    assert ground.command(INJECT, GPS, 0) == ACCEPTED
    assert ground.vehicle.avionics.instruments["failures"][GNSS] == 0
    arena = station(tmp_path / "arena", Navigation.MOCAP, up=2.0)
    assert arena.command(INJECT, VIO, OFF) == ACCEPTED
    assert arena.command(INJECT, MAG, OFF) == UNSUPPORTED


def test_a_battery_that_fails_makes_the_vehicle_land_and_a_wrong_one_reads_less(tmp_path):
    ground = station(tmp_path)
    full = ground.bench.aircraft.battery
    assert ground.command(INJECT, BATTERY, WRONG) == ACCEPTED
    assert full.remaining - ground.bench.aircraft.battery.remaining == pytest.approx(MISREAD, abs=1e-3)
    assert ground.command(INJECT, BATTERY, OFF) == ACCEPTED
    sagged = ground.bench.aircraft.battery
    assert sagged.remaining == pytest.approx(LEFT_AFTER_SAG)
    assert full.voltage() - sagged.voltage() > LOST_CELL
    ground.advance(1.5)
    assert ground.autopilot.landing
    assert ground.command(INJECT, BATTERY, 0) == ACCEPTED
    assert ground.bench.aircraft.battery.remaining > 0.9


def test_a_link_that_is_off_answers_once_then_nothing_and_comes_back_in_its_time(tmp_path):
    ground = station(tmp_path)
    ground.set_parameter("SIM_LINK_OFF_T", 3)
    assert ground.command(INJECT, LINK, OFF) == ACCEPTED
    ground.heard.clear()
    ground.advance(2.9)
    ground.send(mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_NAV_LAND, 0, *(0.0,) * 7))
    assert not ground.heard
    assert not ground.autopilot.landing
    ground.advance(0.3)
    assert "Link is back" in ground.texts()
    assert ground.command(mavlink.MAV_CMD_NAV_LAND) == ACCEPTED


def test_a_vehicle_that_tumbles_says_so_and_is_not_armed_again(tmp_path):
    ground = station(tmp_path, up=60.0)
    assert ground.command(INJECT, MOTOR, OFF, 1) == ACCEPTED
    ground.bench.advance_until(lambda: ground.autopilot.terminated, 5.0)
    ground.advance(0.1)
    assert "Motors cut: tumbling at" in ground.texts()
    assert ground.last("HEARTBEAT").system_status == mavlink.MAV_STATE_FLIGHT_TERMINATION
    assert not ground.last("HEARTBEAT").base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    assert ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1, 21196) == 1
    assert "flight terminated (Tumbling at" in ground.texts()
