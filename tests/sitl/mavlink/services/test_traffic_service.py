"""Other systems tell where they are: kept for a plan that follows one."""

import math

import pytest

from protocol.dialect import mavlink
from tests.support.vehicle.fake_station import FakeStation


@pytest.fixture
def station(tmp_path):
    return FakeStation.with_vehicle(tmp_path, up=2.0)


def follow_target(lat, lon, alt, velocity=(1.0, 2.0, 0.5)):
    zeros = [0.0] * 3
    return mavlink.MAVLink_follow_target_message(0, 3, lat, lon, alt, velocity, zeros, [1.0, *zeros], zeros, zeros, 0)


def heard(station):
    return station.node.aircraft.autopilot.flight_plan.others.heard


def test_a_target_is_kept_in_the_vehicles_frame(station):
    world = station.node.aircraft.autopilot.world
    place = world.frame.to_geodetic((30.0, 40.0, -5.0))
    station.send(follow_target(round(1e7 * place.lat_deg), round(1e7 * place.lon_deg), place.alt))
    (aircraft,) = heard(station).values()
    assert aircraft.p == pytest.approx((30.0, -40.0, 5.0), abs=0.05)
    assert aircraft.v == pytest.approx((1.0, -2.0, -0.5))
    assert math.degrees(aircraft.course) == pytest.approx(math.degrees(math.atan2(2.0, 1.0)))


def test_the_stream_of_an_aircraft_is_kept_too(station):
    place = station.node.aircraft.autopilot.world.frame.to_geodetic((30.0, 40.0, -5.0))
    lat, lon, alt = round(1e7 * place.lat_deg), round(1e7 * place.lon_deg), round(1e3 * place.alt)
    station.send(mavlink.MAVLink_global_position_int_message(0, lat, lon, alt, 0, 100, -200, 50, 0))
    (aircraft,) = heard(station).values()
    assert aircraft.p == pytest.approx((30.0, -40.0, 5.0), abs=0.05)
    assert aircraft.v == pytest.approx((1.0, 2.0, -0.5))


@pytest.mark.parametrize(
    "message",
    [
        follow_target(950_000_000, 0, 10.0),
        follow_target(0, 1_900_000_000, 10.0),
        follow_target(0, 0, math.nan),
        follow_target(0, 0, 10.0, (1e9, 0.0, 0.0)),
    ],
)
def test_places_that_cannot_be_are_not_believed(station, message):
    station.send(message)
    assert heard(station) == {}


def test_a_velocity_that_is_not_told_is_none(station):
    station.send(follow_target(0, 0, 10.0, (math.nan, 0.0, 0.0)))
    (aircraft,) = heard(station).values()
    assert aircraft.v == (0.0, 0.0, 0.0)
