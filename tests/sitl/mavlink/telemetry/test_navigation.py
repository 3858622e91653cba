"""Messages behind MAVSDK's odometry, altitude, ground truth and flight information."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.frames import flip, rotate
from sitl.mavlink.telemetry.navigation import attitude_on_wire
from sitl.mavlink.telemetry.vehicle_snapshot import FlightTimes
from tests.support.vehicle.fake_station import HOME, Bench

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
ARM, LAND, TAKE_OFF = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_TAKEOFF


def ask(station, name):
    number = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    assert station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, number) == ACCEPTED
    return station.last(name)


@pytest.fixture(scope="module")
def moving(tmp_path_factory):
    """A station and its vehicle at 4 m, going north-east."""
    bench = Bench(tmp_path_factory.mktemp("state"), up=4.0)
    station = bench.station()
    place = (HOME.lat_deg + 3e-4, HOME.lon_deg + 4e-4)
    x, y = (round(degrees * 1e7) for degrees in place)
    go = mavlink.MAVLink_command_int_message(
        1, 1, 3, mavlink.MAV_CMD_DO_REPOSITION, 0, 0, -1, 1, math.nan, 0.5, x, y, 4.0
    )
    station.send(go)
    bench.advance(4.0)
    return station


def test_odometry_agrees_with_the_other_messages(moving):
    odometry, local, attitude = (
        ask(moving, name) for name in ("ODOMETRY", "LOCAL_POSITION_NED", "ATTITUDE_QUATERNION")
    )
    assert (odometry.frame_id, odometry.child_frame_id) == (mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_BODY_FRD)
    assert (odometry.x, odometry.y, odometry.z) == pytest.approx((local.x, local.y, local.z), abs=1e-3)
    q = (attitude.q1, attitude.q2, attitude.q3, attitude.q4)
    assert odometry.q == pytest.approx(q, abs=1e-6)
    in_world = rotate(odometry.q, (odometry.vx, odometry.vy, odometry.vz))
    assert math.hypot(*in_world) > 0.5
    assert in_world == pytest.approx((local.vx, local.vy, local.vz), abs=1e-3)
    assert math.isnan(odometry.pose_covariance[0])
    assert math.isnan(odometry.velocity_covariance[0])


def test_altitude_is_given_above_the_sea_home_and_ground(moving):
    altitude, position, local = (ask(moving, n) for n in ("ALTITUDE", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"))
    assert altitude.altitude_amsl == pytest.approx(1e-3 * position.alt, abs=0.01)
    assert altitude.altitude_relative == pytest.approx(1e-3 * position.relative_alt, abs=0.01)
    assert altitude.bottom_clearance == altitude.altitude_local == pytest.approx(-local.z)


def test_ground_truth_is_the_simulated_state(moving):
    truth, body = ask(moving, "HIL_STATE_QUATERNION"), moving.bench.aircraft.vehicle.truth.body
    assert truth.attitude_quaternion == pytest.approx(attitude_on_wire(body.attitude), abs=1e-6)
    assert 1e-3 * truth.alt == pytest.approx(HOME.alt + body.position.z, abs=2e-3)
    assert (truth.vx, truth.vy, truth.vz) == pytest.approx([100.0 * v for v in flip(body.velocity)], abs=1.0)


def test_flight_information_counts_flights_with_their_beginning_and_end(tmp_path):
    bench = Bench(tmp_path)
    station = bench.station()
    before = ask(station, "FLIGHT_INFORMATION")
    assert (before.flight_uuid, before.arming_time_utc, before.takeoff_time_utc, before.landing_time) == (0, 0, 0, 0)
    assert station.command(ARM, 1) == ACCEPTED
    armed_at = bench.aircraft.vehicle.time
    bench.advance(1.0)
    assert station.command(TAKE_OFF, *[math.nan] * 6, 1.0) == ACCEPTED
    bench.advance(2.0)
    flying = ask(station, "FLIGHT_INFORMATION")
    assert flying.flight_uuid == 1
    assert 1e-6 * flying.arming_time_utc == pytest.approx(armed_at, abs=0.05)
    assert armed_at + 1.0 <= 1e-6 * flying.takeoff_time_utc <= armed_at + 3.0
    assert flying.landing_time == 0


def test_a_flight_lands_and_the_next_one_begins_anew():
    times = FlightTimes()
    for time, armed, landed in ((1.0, True, True), (2.0, True, False), (9.0, True, True), (10.0, False, True)):
        times = times.updated(time, armed=armed, landed=landed)
    assert (times.number, times.armed_at, times.took_off_at, times.landed_at) == (1, 1.0, 2.0, 9.0)
    times = times.updated(11.0, armed=True, landed=True)
    assert (times.number, times.armed_at, times.took_off_at, times.landed_at) == (2, 11.0, 0.0, 0.0)


def test_a_vehicle_that_begins_in_the_air_never_took_off():
    times = FlightTimes(landed=False).updated(1.0, armed=True, landed=False)
    assert (times.number, times.took_off_at) == (1, 0.0)
