"""Messages behind MAVSDK's odometry, altitude, ground truth and flight information."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Regime
from protocol.frames import (
    displayed,
    euler_from_quaternion,
    flip,
    flip_quaternion,
    flying_attitude,
    multiply,
    quaternion_from_euler,
    rotate,
)
from sitl.mavlink.telemetry import navigation
from sitl.mavlink.telemetry.navigation import (
    WHILE_AIDED,
    WHILE_ALIGNED,
    attitude_on_wire,
    axes_on_wire,
    estimator_status,
    odometry,
)
from sitl.mavlink.telemetry.vehicle_snapshot import FlightTimes
from sitl.sensors.instruments import GARBAGE, GNSS, OFF
from sitl.simulation.avionics import Navigation
from tests.support.vehicle.fake_station import HOME, Bench, FakeStation

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


# Attitudes on the wire are of the hover frame: level and without a singularity nose-up, as PX4's tail-sitters.


ANGLES = ("roll", "pitch", "yaw")
TILTS = st.floats(-math.radians(60.0), math.radians(60.0))
YAWS = st.floats(-math.pi, math.pi)


@pytest.fixture(scope="module")
def hovering(tmp_path_factory):
    """A vehicle snapshot of a hover that faces north."""
    bench = Bench(tmp_path_factory.mktemp("state"), up=3.0)
    bench.advance(1.0)
    return bench.node.snapshot()


def hovered(roll, pitch, yaw):
    """The vehicle's own quaternion, FLU -> NWU along the nose, of angles of the hover frame."""
    return flip_quaternion(flying_attitude(quaternion_from_euler(roll, pitch, yaw)))


def told(snapshot, q):
    message = navigation.attitude(snapshot._replace(q=q))
    return tuple(getattr(message, angle) for angle in ANGLES)


def test_a_hover_is_level_and_needs_no_offset(hovering):
    assert told(hovering, hovering.q) == pytest.approx((0.0, 0.0, 0.0), abs=0.01)
    message = navigation.attitude_quaternion(hovering)
    assert (message.q1, message.q2, message.q3, message.q4) == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=0.01)
    assert message.repr_offset_q == [1.0, 0.0, 0.0, 0.0]


@settings(deadline=None, max_examples=300)
@given(TILTS, TILTS, YAWS)
def test_roll_pitch_and_yaw_of_a_hover_are_the_attitude(hovering, roll, pitch, yaw):
    assert told(hovering, hovered(roll, pitch, yaw)) == pytest.approx((roll, pitch, yaw), abs=1e-9)


@settings(deadline=None, max_examples=300)
@given(TILTS, TILTS, YAWS, st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_a_small_turn_of_a_hover_is_a_small_change_of_its_angles(hovering, roll, pitch, yaw, axis):
    before, small = hovered(roll, pitch, yaw), [5e-4 * x for x in axis]
    after = multiply(before, (math.sqrt(1.0 - sum(x * x for x in small)), *small))
    changes = [
        math.remainder(b - a, math.tau) for a, b in zip(told(hovering, before), told(hovering, after), strict=True)
    ]
    assert max(map(abs, changes)) < 5e-3


def test_a_whole_turn_of_an_upright_hover_is_a_whole_turn_of_its_yaw_alone(hovering):
    turn = np.linspace(0.0, math.tau, 361)
    angles = np.array([told(hovering, hovered(0.0, 0.0, yaw)) for yaw in turn])
    np.testing.assert_allclose(angles[:, :2], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.unwrap(angles[:, 2]), turn, atol=1e-9)


@pytest.mark.parametrize("regime", Regime)
def test_only_in_forward_flight_are_displays_to_pitch_up(hovering, regime):
    level = flip_quaternion(quaternion_from_euler(0.1, 0.05, 2.0))  # of the nose
    message = navigation.attitude_quaternion(hovering._replace(q=level, regime=regime))
    if regime is Regime.FORWARD:
        q = (message.q1, message.q2, message.q3, message.q4)
        assert message.repr_offset_q == pytest.approx([0.7071, 0.0, 0.7071, 0.0], abs=1e-4)
        assert euler_from_quaternion(displayed(q, message.repr_offset_q)) == pytest.approx((0.1, 0.05, 2.0))
    else:
        assert message.repr_offset_q == [1.0, 0.0, 0.0, 0.0]


def test_a_transition_ends_with_the_nose_on_the_horizon_of_a_display(tmp_path):
    station = Bench(tmp_path, up=30.0).station()
    station.command(mavlink.MAV_CMD_DO_VTOL_TRANSITION, mavlink.MAV_VTOL_STATE_FW)
    station.advance(1.0)
    forward = mavlink.MAV_VTOL_STATE_FW
    station.bench.advance_until(lambda: station.last("EXTENDED_SYS_STATE").vtol_state == forward, 20.0)
    station.advance(0.5)
    message = station.last("ATTITUDE_QUATERNION")
    q = (message.q1, message.q2, message.q3, message.q4)
    _, told_pitch, _ = euler_from_quaternion(q)
    _, pitch, yaw = euler_from_quaternion(displayed(q, message.repr_offset_q))
    assert math.degrees(told_pitch) < -45.0
    assert abs(math.degrees(pitch)) < 30.0
    assert math.degrees(yaw) % 360.0 == pytest.approx(station.last("GLOBAL_POSITION_INT").hdg / 100.0, abs=5.0)


def test_rates_are_about_the_axes_of_the_hover_frame(hovering):
    message = navigation.attitude(hovering._replace(rates=(0.3, 0.2, 0.1)))  # about nose, left wing and back
    assert (message.rollspeed, message.pitchspeed, message.yawspeed) == (-0.1, -0.2, -0.3)


@settings(deadline=None, max_examples=100)
@given(TILTS, TILTS, YAWS, st.tuples(*[st.floats(-9.0, 9.0)] * 3))
def test_a_body_vector_is_the_same_vector_in_both_frames(roll, pitch, yaw, v):
    own = rotate(hovered(roll, pitch, yaw), v)
    on_wire = rotate(quaternion_from_euler(roll, pitch, yaw), axes_on_wire(v))
    assert on_wire == pytest.approx((own[0], -own[1], -own[2]), abs=1e-9)


# ESTIMATOR_STATUS and the variances of ODOMETRY: how far the vehicle trusts its own navigation.


@pytest.fixture
def station(tmp_path):
    station = FakeStation.with_vehicle(tmp_path, up=9.0, navigation=Navigation.SENSORS)
    station.advance(3.0)
    return station


def estimated(station):
    (message,) = estimator_status(station.node.snapshot())
    return message


def test_a_vehicle_whose_sensors_agree_knows_where_it_is(station):
    now = estimated(station)
    assert now.flags == WHILE_ALIGNED | WHILE_AIDED
    assert 0.0 < now.pos_horiz_accuracy < 2.0
    assert 0.0 < now.pos_vert_accuracy < 2.0
    for ratio in (now.vel_ratio, now.pos_horiz_ratio, now.pos_vert_ratio, now.mag_ratio):
        assert 0.0 <= ratio < 1.0
    assert math.isnan(now.hagl_ratio)
    assert station.last("ESTIMATOR_STATUS") is not None


def test_without_satellites_the_position_is_a_relative_one(station):
    station.vehicle.avionics.instruments["failures"][GNSS] = OFF
    before = estimated(station).pos_horiz_accuracy
    station.advance(3.0)
    now = estimated(station)
    assert now.flags == WHILE_ALIGNED
    assert now.pos_horiz_accuracy > before


def test_readings_that_are_refused_are_a_glitch(station):
    station.vehicle.avionics.instruments["failures"][GNSS] = GARBAGE
    station.bench.advance_until(lambda: estimated(station).pos_horiz_ratio > 1.0, 3.0)
    station.bench.advance_until(lambda: estimated(station).flags & mavlink.ESTIMATOR_GPS_GLITCH, 3.0)


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
