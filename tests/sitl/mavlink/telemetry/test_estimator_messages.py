"""ESTIMATOR_STATUS and the variances of ODOMETRY: how far the vehicle trusts its own navigation."""

import math

import pytest

from protocol.dialect import mavlink
from sitl.mavlink.telemetry.navigation import WHILE_AIDED, WHILE_ALIGNED, estimator_status, odometry
from sitl.sensors.instruments import GARBAGE, GNSS, OFF
from sitl.simulation.avionics import Navigation
from tests.support.vehicle.fake_station import FakeStation


@pytest.fixture
def station(tmp_path):
    station = FakeStation.with_vehicle(tmp_path, up=9.0, navigation=Navigation.SENSORS)
    station.advance(3.0)
    return station


def told(station):
    (message,) = estimator_status(station.node.snapshot())
    return message


def test_a_vehicle_whose_sensors_agree_knows_where_it_is(station):
    now = told(station)
    assert now.flags == WHILE_ALIGNED | WHILE_AIDED
    assert 0.0 < now.pos_horiz_accuracy < 2.0
    assert 0.0 < now.pos_vert_accuracy < 2.0
    for ratio in (now.vel_ratio, now.pos_horiz_ratio, now.pos_vert_ratio, now.mag_ratio):
        assert 0.0 <= ratio < 1.0
    assert math.isnan(now.hagl_ratio)
    assert station.last("ESTIMATOR_STATUS") is not None


def test_without_satellites_the_position_is_a_relative_one(station):
    station.vehicle.avionics.instruments["failures"][GNSS] = OFF
    before = told(station).pos_horiz_accuracy
    station.advance(3.0)
    now = told(station)
    assert now.flags == WHILE_ALIGNED
    assert now.pos_horiz_accuracy > before


def test_readings_that_are_refused_are_a_glitch(station):
    station.vehicle.avionics.instruments["failures"][GNSS] = GARBAGE
    station.bench.advance_until(lambda: told(station).pos_horiz_ratio > 1.0, 3.0)
    station.bench.advance_until(lambda: told(station).flags & mavlink.ESTIMATOR_GPS_GLITCH, 3.0)


def test_odometry_carries_the_filter_s_variances_and_resets(station):
    snapshot = station.node.snapshot()
    now = odometry(snapshot._replace(navigation=snapshot.navigation._replace(resets=258)))
    deviation = snapshot.navigation.position_deviation
    assert (now.pose_covariance[0], now.pose_covariance[11]) == pytest.approx((deviation.x**2, deviation.z**2))
    assert now.pose_covariance[15] == pytest.approx(snapshot.navigation.attitude_deviation.z**2)  # about the belly
    assert now.pose_covariance[20] == pytest.approx(snapshot.navigation.attitude_deviation.x**2)  # about the nose
    assert now.velocity_covariance[0] == pytest.approx(max(snapshot.navigation.velocity_deviation) ** 2)
    assert now.reset_counter == 2
    assert (now.estimator_type, now.quality) == (mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT, 100)
    assert odometry(snapshot._replace(has_position=False)).quality == 1


def test_on_the_exact_state_there_is_no_filter(tmp_path):
    snapshot = FakeStation.with_vehicle(tmp_path).node.snapshot()
    assert estimator_status(snapshot) == []
    assert math.isnan(odometry(snapshot).pose_covariance[0])
    assert odometry(snapshot).estimator_type == mavlink.MAV_ESTIMATOR_TYPE_NAIVE
