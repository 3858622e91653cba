"""Set-points of position, velocity and acceleration in every frame: flown, or refused with a reason."""

import math
import random

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.frames import quaternion_from_euler
from protocol.names import Mode
from sitl.autopilot.settings import Settings
from sitl.control.hover_attitude import full_force
from sitl.guidance.setpoints import LIFT_HEIGHT, MIN_THRUST
from sitl.model.vectors import norm
from tests.support.flights.recorded_flight import NOMINAL
from tests.support.vehicle.fake_station import NAN, FakeStation

LOCAL, OFFSET, BODY_NED, BODY_OFFSET, BODY_FRD = 1, 7, 8, 9, 12
POSITION, VELOCITY, ACCELERATION = 2552, 2503, 3135  # masks as MAVSDK sends them, with a yaw but for the last
VELOCITY_BODY = 1479  # with a yaw rate
NO_YAW = 0b1100_0000_0000


class Program(FakeStation):
    """A program that streams set-points to a hovering vehicle."""

    def setpoint(self, frame, mask, p=(0, 0, 0), v=(0, 0, 0), a=(0, 0, 0), yaw=0.0, yaw_rate=0.0):
        self.send(
            mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *p, *v, *a, yaw, yaw_rate)
        )

    def stream(self, seconds, *args, **kwargs):
        for _ in range(round(seconds / 0.05)):
            self.setpoint(*args, **kwargs)
            if self.mode is not Mode.OFFBOARD:
                self.command(mavlink.MAV_CMD_DO_SET_MODE, 1, *Mode.OFFBOARD.value)
            self.advance(0.04)

    @property
    def mode(self):
        return self.node.aircraft.autopilot.mode

    @property
    def yaw(self):
        """Direction of the belly, clockwise from north [rad]."""
        return self.node.snapshot().yaw

    @property
    def ned(self):
        """Position and velocity."""
        body, flip = self.vehicle.truth.body, np.array((1.0, -1.0, -1.0))
        return np.array(body.position) * flip, np.array(body.velocity) * flip


@pytest.fixture
def program(tmp_path):
    return Program.with_vehicle(tmp_path, up=3.0)


@pytest.fixture
def eastward(tmp_path):
    """A program whose vehicle heads east."""
    program = Program.with_vehicle(tmp_path, up=5.0, heading=-math.pi / 2.0)
    assert program.yaw == pytest.approx(math.pi / 2.0, abs=0.01)
    return program


# Velocities


@pytest.mark.parametrize("frame", [BODY_NED, BODY_OFFSET, BODY_FRD])
def test_a_body_velocity_is_along_the_heading(eastward, frame):
    eastward.stream(4.0, frame, VELOCITY | NO_YAW, v=(1.5, 0.5, -0.5))
    _, v = eastward.ned
    assert v == pytest.approx([-0.5, 1.5, -0.5], abs=0.2)
    assert eastward.yaw == pytest.approx(math.pi / 2.0, abs=0.1)


@pytest.mark.parametrize("frame", [LOCAL, OFFSET])
def test_a_velocity_in_a_local_frame_is_not_turned(eastward, frame):
    eastward.stream(4.0, frame, VELOCITY | NO_YAW, v=(1.5, 0.5, -0.5))
    assert eastward.ned[1] == pytest.approx([1.5, 0.5, -0.5], abs=0.15)


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("frame", "rate"), [(LOCAL, -20.0), (LOCAL, 10.0), (BODY_NED, -10.0), (BODY_NED, 20.0)])
def test_a_yaw_rate_turns_the_heading(program, frame, rate):
    yaws = []
    program.stream(3.0, frame, VELOCITY_BODY, yaw_rate=math.radians(rate))
    for _ in range(30):
        program.stream(0.1, frame, VELOCITY_BODY, yaw_rate=math.radians(rate))
        yaws.append(program.yaw)
    turned = math.degrees(np.unwrap(yaws)[-1] - yaws[0])
    assert turned == pytest.approx(rate * 0.08 * 29, rel=0.1)  # 0.1 s of stream is 0.08 s of flight
    assert np.linalg.norm(program.ned[0] - (0, 0, -3)) < 1.0


@pytest.mark.long
def test_forward_with_a_yaw_rate_is_a_circle(program):
    """As MAVSDK streams it: 0.7 m/s ahead at 20 deg/s is a circle of 2 m."""
    program.stream(8.0, BODY_NED, VELOCITY_BODY, v=(0.7, 0.0, 0.0), yaw_rate=math.radians(20.0))
    places = []
    for _ in range(230):
        program.stream(0.1, BODY_NED, VELOCITY_BODY, v=(0.7, 0.0, 0.0), yaw_rate=math.radians(20.0))
        places.append(program.ned[0][:2])
    across = np.ptp(places, axis=0) / 2.0
    assert (across > 1.8).all()
    assert (across < 2.8).all()


@pytest.mark.long
@pytest.mark.parametrize("yaw", [20.0, -1e6, 3.3e38])
def test_a_yaw_of_many_turns_is_wrapped(program, yaw):
    program.stream(12.0, LOCAL, POSITION, p=(0, 0, -5), yaw=yaw)
    left = math.remainder(float(np.float32(yaw)), math.tau)
    assert abs(math.remainder(program.yaw - left, math.tau)) < 0.05


@pytest.mark.long
def test_a_turn_that_stops_goes_no_further(program):
    program.stream(5.0, LOCAL, VELOCITY_BODY, yaw_rate=math.radians(20.0))
    before = program.yaw
    program.stream(5.0, LOCAL, VELOCITY_BODY)
    assert math.degrees(program.yaw - before) == pytest.approx(0.0, abs=8.0)


def test_too_fast_a_turn_is_refused(program):
    program.setpoint(BODY_NED, VELOCITY_BODY, yaw_rate=math.radians(30.0))
    assert "30 deg/s: the hover turns with up to 20 deg/s" in program.texts()


# Offsets


@pytest.mark.long
@pytest.mark.parametrize(("frame", "place"), [(OFFSET, (4.0, 1.0, -6.0)), (BODY_OFFSET, (-1.0, 4.0, -6.0))])
def test_a_repeated_offset_keeps_its_place(eastward, frame, place):
    eastward.stream(10.0, frame, POSITION | NO_YAW, p=(4.0, 1.0, -1.0))
    assert eastward.ned[0] == pytest.approx(place, abs=0.2)


@pytest.mark.long
def test_a_new_offset_counts_from_where_the_vehicle_is_then(program):
    program.stream(8.0, OFFSET, POSITION | NO_YAW, p=(3.0, 0.0, 0.0))
    program.stream(8.0, BODY_FRD, POSITION | NO_YAW, p=(0.0, 2.0, 0.0))
    assert program.ned[0] == pytest.approx([3.0, 2.0, -3.0], abs=0.2)


@pytest.mark.long
def test_an_offset_repeated_after_a_pause_is_a_new_one(program):
    program.stream(8.0, OFFSET, POSITION | NO_YAW, p=(3.0, 0.0, 0.0))
    program.advance(1.0)
    assert program.mode is Mode.HOLD
    program.stream(8.0, OFFSET, POSITION | NO_YAW, p=(3.0, 0.0, 0.0))
    assert program.ned[0][0] == pytest.approx(6.0, abs=0.2)


# Accelerations


def test_an_acceleration_is_flown_as_an_attitude(program):
    program.stream(1.0, LOCAL, ACCELERATION)
    program.stream(1.25, LOCAL, ACCELERATION, a=(1.5, 0.0, 0.0))
    before = program.ned[1]
    program.stream(0.5, LOCAL, ACCELERATION, a=(1.5, 0.0, 0.0))
    assert program.vehicle.law is Law.HOVER_ATTITUDE
    gained = (program.ned[1] - before) / 0.4
    assert 0.8 < gained[0] < 1.5  # less than requested: the wing is in the air stream by now
    assert abs(gained[1]) < 0.05
    assert gained[2] < 0.1


def test_a_body_acceleration_is_along_the_heading(eastward):
    eastward.stream(1.25, BODY_NED, ACCELERATION, a=(1.0, 0.0, 0.0))
    v = eastward.ned[1]
    assert v[1] > 0.5
    assert abs(v[0]) < 0.1


def test_an_acceleration_that_tilts_too_far_is_refused(program):
    program.setpoint(LOCAL, ACCELERATION, a=(12.0, 0.0, 0.0))
    assert "51 deg from the vertical" in program.texts()
    program.setpoint(LOCAL, ACCELERATION, a=(0.0, 0.0, -15.0))
    assert "thrust 1.20 is not within" in program.texts()


# Refusals


@pytest.mark.parametrize(
    ("frame", "mask", "fields", "reason"),
    [
        (BODY_NED, POSITION, {"p": (1, 0, 0)}, "frame 8 is not supported"),
        (2, VELOCITY, {"v": (1, 0, 0)}, "frame 2 is not supported"),
        (LOCAL, POSITION | 0b1, {"p": (1, 0, -3)}, "part of a position"),
        (LOCAL, VELOCITY | 0b1000, {"v": (1, 0, 0)}, "part of a velocity"),
        (LOCAL, 0b1111_1111_1111, {}, "without position, velocity or acceleration"),
        (LOCAL, ACCELERATION | 0b10_0000_0000, {"a": (0, 0, -9)}, "without position, velocity or acceleration"),
        (LOCAL, VELOCITY, {"v": (NAN, 0, 0)}, "not a number"),
        (LOCAL, ACCELERATION, {"a": (0, math.inf, 0)}, "not a number"),
        (LOCAL, VELOCITY, {"v": (1, 0, 0), "yaw": math.inf}, "not a number"),
        (BODY_NED, VELOCITY_BODY, {"v": (1, 0, 0), "yaw_rate": -math.inf}, "not a number"),
        (OFFSET, POSITION, {"p": (NAN, 0, 0)}, "not a number"),
        (OFFSET, POSITION, {"p": (1e7, 0, 0)}, "arena"),
        (BODY_NED, VELOCITY_BODY, {"v": (5, 0, 0)}, "hover to 3, forward flight from 7 m/s"),
        (LOCAL, VELOCITY, {"v": (12, 0, 8)}, "-8 m/s up at 12.0 m/s level is too steep for forward flight"),
        (LOCAL, VELOCITY, {"v": (12, 0, -3e38)}, "3e+38 m/s up at 12.0 m/s level is too steep"),
    ],
)
def test_a_set_point_that_cannot_be_flown_is_refused_with_a_reason_and_changes_nothing(
    program, frame, mask, fields, reason
):
    autopilot = program.node.aircraft.autopilot
    before = autopilot.reference
    program.setpoint(frame, mask, **fields)
    assert reason in program.texts()
    program.command(mavlink.MAV_CMD_DO_SET_MODE, 1, *Mode.OFFBOARD.value)
    assert program.last("COMMAND_ACK").result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert (autopilot.reference, autopilot.mode) == (before, Mode.HOLD)


@pytest.mark.long
def test_a_velocity_beside_a_position_is_not_used(program):
    both = 0b1001_1100_0000 | 0b0100_0000_0000
    program.stream(8.0, LOCAL, both, p=(3.0, 0.0, -4.0), v=(0.0, 2.0, 0.0))
    assert program.ned[0] == pytest.approx([3.0, 0.0, -4.0], abs=0.2)


@pytest.mark.long
def test_no_set_point_breaks_the_flight(program):
    """1000 set-points of random kinds, masks, frames and numbers, impossible ones as well."""
    rng = random.Random(5)

    def numbers(count):
        odd = (NAN, math.inf, -math.inf, 3e38, -3e38, 1e-38, 0.0)
        return [rng.choice(odd) if rng.random() < 0.2 else rng.uniform(-10.0, 10.0) for _ in range(count)]

    for number in range(1000):
        mask = rng.choice((POSITION, VELOCITY, VELOCITY_BODY, ACCELERATION, rng.randrange(4096)))
        frame = rng.choice((LOCAL, OFFSET, BODY_NED, BODY_OFFSET, BODY_FRD, rng.randrange(22)))
        if number % 3 == 0:
            tilt = rng.uniform(-1.0, 1.0)
            q = [math.cos(tilt), 0.0, math.sin(tilt), 0.0] if rng.random() < 0.7 else numbers(4)
            message = mavlink.MAVLink_set_attitude_target_message(0, 1, 1, rng.choice((7, 0)), q, *numbers(3), 0.5)
        elif number % 3 == 1:
            message = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *numbers(11))
        else:
            place = (435_648_000, 14_811_000)
            message = mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, 6, mask, *place, *numbers(9))
        program.send(message)
        if number % 15 == 0:
            program.command(mavlink.MAV_CMD_DO_SET_MODE, 1, *Mode.OFFBOARD.value)
        program.advance(0.04)
    jumped = {jump.name for jump in program.vehicle.jumps}
    assert {"steer", "let_go_indi"} <= jumped
    assert not jumped & {"catch_fall", "upset"}


# Streamed attitude set-points over MAVLink: what is flown, and what is refused with a reason.


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


@pytest.mark.long
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


@pytest.mark.long
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


@pytest.mark.long
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


@pytest.mark.long
def test_when_the_stream_stops_it_holds(streaming):
    streaming.start()
    streaming.stream(1.0, pitch=-15.0)
    streaming.advance(1.0)
    assert streaming.mode is Mode.HOLD
    assert "Set-points stopped: holding" in streaming.texts()
    streaming.advance(4.0)
    assert norm(streaming.vehicle.truth.body.velocity) < 0.2
    assert [jump.name for jump in streaming.vehicle.jumps] == ["steer", "let_go_indi", "enter_proved"]


@pytest.mark.parametrize(("action", "mode"), [(3, Mode.RTL), (4, Mode.LAND), (5, Mode.HOLD)])
def test_a_parameter_decides_what_follows_a_stopped_stream(streaming, action, mode):
    streaming.node.aircraft.autopilot.configure(Settings(setpoint_action=action))
    streaming.start()
    streaming.stream(0.6, pitch=-10.0)
    streaming.advance(0.6)
    assert streaming.mode is mode


@pytest.mark.long
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


@pytest.mark.long
def test_more_thrust_than_its_weight_lifts_it_off_and_attitudes_take_over_at_their_height(standing):
    standing.stream(4.0, thrust=1.05 * HOVER)
    vehicle = standing.node.aircraft.vehicle
    assert vehicle.law is Law.HOVER_ATTITUDE
    assert vehicle.truth.body.position.z > LIFT_HEIGHT
    assert standing.mode is Mode.OFFBOARD


@pytest.mark.long
def test_a_lift_off_whose_stream_stops_ends_in_a_hold(standing):
    standing.stream(1.0, thrust=1.05 * HOVER)
    standing.advance(3.0)
    assert standing.mode is Mode.HOLD
    assert standing.node.aircraft.vehicle.truth.body.position.z > 0.9
