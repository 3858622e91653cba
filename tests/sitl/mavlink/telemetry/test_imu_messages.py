"""HIGHRES_IMU, SCALED_IMU and RAW_IMU, as MAVSDK's imu topics read them: hover frame FRD."""

import math

import pytest

from protocol.dialect import mavlink
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.mavlink.telemetry import sensor_messages
from sitl.model.airframe_files import load
from sitl.model.vectors import Vector
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings
from tests.support.vehicle.fake_station import FRAME, FakeStation

G = 9.81


@pytest.fixture(scope="module", params=[0.0, 3.0], ids=["standing", "hovering"])
def station(request, tmp_path_factory):
    station = FakeStation.with_vehicle(tmp_path_factory.mktemp("state"), up=request.param)
    station.advance(3.0)
    return station


def test_at_rest_only_the_weight_is_felt_and_it_points_up(station):
    told = station.last("HIGHRES_IMU")
    assert (told.xacc, told.yacc, told.zacc) == pytest.approx((0.0, 0.0, -G), abs=0.15)
    assert (told.xgyro, told.ygyro, told.zgyro) == pytest.approx((0.0, 0.0, 0.0), abs=0.02)
    assert told.time_usec == pytest.approx(1e6 * station.vehicle.time, abs=0.1e6)


@pytest.mark.parametrize("name", ["SCALED_IMU", "RAW_IMU"])
def test_the_scaled_ones_count_thousandths_of_g(station, name):
    told = station.last(name)
    assert (told.xacc, told.yacc, told.zacc) == pytest.approx((0, 0, -1000 * G / 9.80665), abs=15)
    assert max(abs(told.xgyro), abs(told.ygyro), abs(told.zgyro)) < 20


def test_what_no_sensor_measures_is_marked_so(station):
    told = station.last("HIGHRES_IMU")
    assert told.fields_updated == 0b11_1111
    assert all(math.isnan(getattr(told, name)) for name in ("xmag", "ymag", "zmag", "abs_pressure", "temperature"))


def test_rates_are_those_of_attitude(station):
    snapshot = station.node.snapshot()._replace(rates=Vector(0.3, 0.2, 0.1))
    told, scaled = sensor_messages.highres_imu(snapshot), sensor_messages.scaled_imu(snapshot)
    assert (told.xgyro, told.ygyro, told.zgyro) == (-0.1, -0.2, -0.3)
    assert (scaled.xgyro, scaled.ygyro, scaled.zgyro) == (-100, -200, -300)


def test_more_than_a_field_holds_is_its_limit(station):
    snapshot = station.node.snapshot()._replace(rates=Vector(-50.0, 0.0, 50.0))
    for message in (sensor_messages.scaled_imu(snapshot), sensor_messages.raw_imu(snapshot)):
        assert (message.xgyro, message.zgyro) == (-32767, 32767)


@pytest.mark.parametrize("name", ["HIGHRES_IMU", "SCALED_IMU", "RAW_IMU"])
def test_a_rate_can_be_asked_for(station, name):
    number = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    assert station.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, number, 50_000.0) == mavlink.MAV_RESULT_ACCEPTED
    station.heard.clear()
    station.advance(1.0)
    assert len(station.all(name)) == pytest.approx(20, abs=1)


def test_a_vehicle_with_sensors_tells_what_they_read(tmp_path):
    start = Start(up=3.0, airborne=True)
    vehicle = Simulation(load("nominal").parameters, start=start, navigation=Navigation.SENSORS)
    configuration = Configuration(Settings(), Tuning(), WorldSettings())
    aircraft = Aircraft(vehicle, World(FRAME, ARENAS["open"]), configuration, airborne=True)
    station = FakeStation.with_vehicle(tmp_path, aircraft=aircraft)
    station.advance(1.0)
    told, read = sensor_messages.highres_imu(station.node.snapshot()), vehicle.avionics.instruments["inertial"]
    forward, left, up = read["force"].item()
    assert (told.xacc, told.yacc, told.zacc) == (-up, -left, -forward)
    assert -told.zacc == pytest.approx(G, abs=3.0)
    rolling, pitching, yawing = read["rates"].item()
    assert (told.xgyro, told.ygyro, told.zgyro) == (-yawing, -pitching, -rolling)
