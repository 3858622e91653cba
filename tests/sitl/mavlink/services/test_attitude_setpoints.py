"""Streamed attitude set-points over MAVLink: what is flown, and what is refused with a reason."""

import math

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.frames import quaternion_from_euler
from protocol.names.modes import Mode
from sitl.autopilot.settings import Settings
from sitl.control.hover_attitude import full_force
from sitl.guidance.setpoints import LIFT_HEIGHT, MIN_THRUST
from sitl.model.vectors import norm
from tests.support.flights.recorded_flight import NOMINAL
from tests.support.vehicle.fake_station import FakeStation

HOVER = NOMINAL.m * NOMINAL.g / full_force(NOMINAL)  # thrust of a hover


class Streaming(FakeStation):
    """A program that streams attitudes; angles as ATTITUDE has them, all 0 in a hover that faces north."""

    def attitude(self, pitch=0.0, roll=0.0, yaw=0.0, thrust=HOVER, mask=0b111, rates=(0.0, 0.0, 0.0), q=None):
        q = quaternion_from_euler(*np.radians((roll, pitch, yaw))) if q is None else q
        self.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, list(q), *rates, thrust))

    def start(self, **attitude):
        self.attitude(**attitude)
        return self.command(mavlink.MAV_CMD_DO_SET_MODE, 1, *Mode.OFFBOARD.value)

    def stream(self, seconds, **attitude):
        for _ in range(round(seconds / 0.04)):
            self.attitude(**attitude)
            self.advance(0.04)

    @property
    def mode(self):
        return self.node.aircraft.autopilot.mode


@pytest.fixture
def streaming(tmp_path):
    station = Streaming.with_vehicle(tmp_path, up=3.0)
    station.ask_for("DARKO_HYBRID_STATE")
    return station


def test_a_height_is_held_by_a_program_that_sends_thrust(streaming):
    assert streaming.start() == mavlink.MAV_RESULT_ACCEPTED
    for _ in range(150):
        seen = streaming.last("LOCAL_POSITION_NED")
        streaming.stream(0.04, thrust=HOVER * (1.0 + 0.25 * (4.0 + seen.z) + 0.3 * seen.vz))
    assert streaming.last("LOCAL_POSITION_NED").z == pytest.approx(-4.0, abs=0.02)
    told = streaming.last("DARKO_HYBRID_STATE")
    assert told.law == Law.HOVER_ATTITUDE
    assert told.v_attitude < 1e-5
    assert streaming.last("DARKO_ENERGY").energy_by_law[Law.HOVER_ATTITUDE] > 500.0


def test_mavsdks_example_hovers_level(streaming):
    """It begins with Attitude(0, 0, 0, 0), starts OFFBOARD and raises the thrust."""
    assert streaming.start(thrust=0.0) == mavlink.MAV_RESULT_ACCEPTED
    streaming.stream(2.0)
    seen, told = streaming.last("LOCAL_POSITION_NED"), streaming.last("ATTITUDE")
    assert (told.roll, told.pitch, told.yaw) == pytest.approx((0.0, 0.0, 0.0), abs=0.01)
    assert math.hypot(seen.vx, seen.vy) < 0.1
    assert seen.z == pytest.approx(-3.0, abs=0.2)
    assert streaming.mode is Mode.OFFBOARD


@pytest.mark.parametrize(
    ("roll", "pitch", "yaw", "north", "east"),
    [
        (0.0, -10.0, 0.0, 1, 0),
        (0.0, 10.0, 0.0, -1, 0),
        (0.0, -10.0, 90.0, 0, 1),
        (10.0, 0.0, 0.0, 0, 1),
        (-10.0, 0.0, 0.0, 0, -1),
    ],
)
def test_a_tilt_moves_as_a_multicopters(streaming, roll, pitch, yaw, north, east):
    streaming.start()
    streaming.stream(2.0, yaw=yaw)
    streaming.stream(1.0, roll=roll, pitch=pitch, yaw=yaw)
    seen, told = streaming.last("LOCAL_POSITION_NED"), streaming.last("ATTITUDE")
    assert (round(seen.vx), round(seen.vy)) == (north, east)
    assert (told.roll, told.pitch, told.yaw) == pytest.approx(np.radians((roll, pitch, yaw)), abs=0.02)


@pytest.mark.parametrize(("axis", "angle"), [(0, "roll"), (1, "pitch"), (2, "yaw")])
def test_body_rates_turn_the_attitude_about_the_axes_of_the_hover_frame(streaming, axis, angle):
    streaming.start()
    streaming.stream(1.0)
    rates = np.where(np.arange(3) == axis, 0.3, 0.0)
    streaming.attitude(mask=0, rates=rates)
    streaming.advance(0.4)
    told = streaming.last("ATTITUDE")
    turned = {name: getattr(told, name) for name in ("roll", "pitch", "yaw")}
    assert turned.pop(angle) > 0.06
    assert max(map(abs, turned.values())) < 0.01
    assert getattr(told, f"{angle}speed") > 0.2


def test_when_the_stream_stops_it_holds(streaming):
    streaming.start()
    streaming.stream(1.0, pitch=-15.0)
    streaming.advance(1.0)
    assert streaming.mode is Mode.HOLD
    assert "Set-points stopped: holding" in streaming.texts()
    streaming.advance(4.0)
    assert norm(streaming.vehicle.truth.body.velocity) < 0.2
    assert [jump.name for jump in streaming.vehicle.jumps] == ["steer", "let_go", "enter_linear"]


@pytest.mark.parametrize(("action", "mode"), [(3, Mode.RTL), (4, Mode.LAND), (5, Mode.HOLD)])
def test_a_parameter_decides_what_follows_a_stopped_stream(streaming, action, mode):
    streaming.node.aircraft.autopilot.configure(Settings(setpoint_action=action))
    streaming.start()
    streaming.stream(0.6, pitch=-10.0)
    streaming.advance(0.6)
    assert streaming.mode is mode


def test_another_set_point_takes_over_without_leaving_offboard(streaming):
    streaming.start()
    streaming.stream(1.0, pitch=-10.0)
    for _ in range(50):
        streaming.send(
            mavlink.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, 1, 0b0000_1101_1111_1000, 2.0, 0.0, -4.0, 0, 0, 0, 0, 0, 0, 0, 0
            )
        )
        streaming.advance(0.1)
    assert streaming.mode is Mode.OFFBOARD
    assert streaming.vehicle.truth.body.position == pytest.approx([2.0, 0.0, 4.0], abs=0.2)


@pytest.mark.parametrize(
    ("attitude", "said"),
    [
        ({"pitch": -46.0}, "46 deg from the vertical"),
        ({"pitch": -90.0}, "90 deg from the vertical exceeds the limit of 45 deg"),
        ({"q": (0.7, 0.0, 0.1, 0.0)}, "norm 0.71"),
        ({"q": (math.nan, 0.0, 0.7, 0.0)}, "not a number"),
        ({"thrust": math.nan}, "not a number"),
        ({"thrust": 1.2}, "thrust is 1.2, not a number from 0 to 1"),
        ({"thrust": -0.1}, "thrust is -0.1, not a number from 0 to 1"),
        ({"mask": 0b1000_0000, "rates": (0.1, 0.0, 0.0)}, "body rates alone"),
        ({"mask": 0b0100_0111}, "thrust along the nose"),
        ({"mask": 0b0010_0111}, "thrust along the nose"),
        ({"mask": 0, "rates": (math.inf, 0.0, 0.0)}, "not a number"),
        ({"mask": 0, "rates": (4.0, 0.0, 0.0)}, "body rates of 4.0 rad/s"),
    ],
)
def test_what_cannot_be_flown_is_refused_with_a_reason_and_changes_nothing(streaming, attitude, said):
    streaming.start()
    streaming.stream(0.4)
    before = streaming.node.aircraft.autopilot.manoeuvre
    streaming.attitude(**attitude)
    assert said in streaming.texts()
    assert streaming.node.aircraft.autopilot.manoeuvre is before
    streaming.stream(1.0, **attitude)
    assert streaming.mode is Mode.HOLD  # nothing that could be flown came any more


def test_less_thrust_than_the_elevons_need_is_flown_as_that_much(streaming):
    streaming.start()
    streaming.stream(0.1, thrust=0.1)
    assert streaming.autopilot.reference.attitude.thrust == MIN_THRUST
    assert "refused" not in streaming.texts()


def test_in_forward_flight_it_asks_for_a_transition(streaming):
    autopilot = streaming.autopilot
    autopilot.update(autopilot.view._replace(forward=True))
    streaming.attitude()
    assert "make a transition to hover first" in streaming.texts()


def test_masked_rates_are_ignored(streaming):
    streaming.start()
    streaming.stream(0.5, mask=0b111, rates=(math.nan, math.nan, math.nan))
    assert streaming.mode is Mode.OFFBOARD


@pytest.fixture
def standing(tmp_path):
    station = Streaming.with_vehicle(tmp_path)
    assert station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == mavlink.MAV_RESULT_ACCEPTED
    assert station.start(thrust=0.0) == mavlink.MAV_RESULT_ACCEPTED
    return station


def test_on_the_ground_it_stands_while_the_thrust_is_less_than_its_weight(standing):
    standing.stream(2.0, thrust=0.95 * HOVER)
    assert standing.node.aircraft.vehicle.law is Law.LANDED
    assert standing.mode is Mode.OFFBOARD


def test_more_thrust_than_its_weight_lifts_it_off_and_attitudes_take_over_at_their_height(standing):
    standing.stream(4.0, thrust=1.05 * HOVER)
    vehicle = standing.node.aircraft.vehicle
    assert vehicle.law is Law.HOVER_ATTITUDE
    assert vehicle.truth.body.position.z > LIFT_HEIGHT
    assert standing.mode is Mode.OFFBOARD


def test_a_lift_off_whose_stream_stops_ends_in_a_hold(standing):
    standing.stream(1.0, thrust=1.05 * HOVER)
    standing.advance(3.0)
    assert standing.mode is Mode.HOLD
    assert standing.node.aircraft.vehicle.truth.body.position.z > 0.9
