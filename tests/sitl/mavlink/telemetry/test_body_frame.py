"""Attitudes on the wire are of the hover frame: level and without a singularity nose-up, as PX4's tail-sitters."""

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
    flip_quaternion,
    flying_attitude,
    multiply,
    quaternion_from_euler,
    rotate,
)
from sitl.mavlink.telemetry import navigation
from sitl.mavlink.telemetry.navigation import axes_on_wire
from tests.support.vehicle.fake_station import Bench

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
