"""Streamed attitudes: how they are followed, what ends them, and the way back to the hover."""

import math

import numpy as np
import pytest
from sitl.hybrid.supervisor import Law
from sitl.kernels.quaternion import conjugate, from_rotation_vector, hover, multiply, rotate
from sitl.kernels.state import ACTUATOR, P, Q, V, W
from sitl.vehicle import Start, Vehicle
from sitl.watch import LOST

from protocol.dialect import mavlink
from protocol.frames import quaternion_from_euler
from protocol.modes import Mode
from sitl.autopilot.attitude import MAX_SINK, MAX_SPEED, MIN_THRUST, attitude_of
from sitl.autopilot.fence import Fence
from sitl.autopilot.guidance import Attitude, Setpoint
from sitl.autopilot.settings import Settings
from sitl.design.attitude import full_force
from tests.support.ground import Ground
from tests.support.wing_flight import NOMINAL, Flight

HOVER = NOMINAL.m * NOMINAL.g / full_force(NOMINAL)  # thrust of a hover
NOSE = np.array((1.0, 0.0, 0.0))
STILL, HEAD_WIND, SPAN_WIND = (0.0, 0.0, 0.0), (-3.0, 0.0, 0.0), (0.0, 3.0, 0.0)


def tilted(axis, deg, heading=0.0):
    """The hover turned about a body axis."""
    return multiply(hover(heading), from_rotation_vector(np.radians(deg) * np.eye(3)["xyz".index(axis)]))


def thrust_at(q):
    """That carries the weight at a tilt."""
    return HOVER / rotate(q, NOSE)[2]


class Steered:
    """A bare vehicle that hovers for 5 s, then is given attitudes."""

    def __init__(self, wind=STILL, seed=1, gusts=0.0, law=Law.HOVER_LINEAR):
        self.vehicle = Vehicle(NOMINAL, seed=seed, start=Start(up=200.0, airborne=True))
        self.vehicle.begin_flight(law)
        self.vehicle.set_wind(wind, gusts)
        self.vehicle.advance(2500)

    def steer(self, q, thrust=None, rates=(0.0, 0.0, 0.0)):
        attitude = Attitude(tuple(q), tuple(rates), thrust_at(q) if thrust is None else thrust)
        p = tuple(self.vehicle.plant[P : P + 3])
        self.vehicle.set_target(Setpoint(p, 0.0, 3.0, attitude=attitude))

    def fly(self, q, seconds, thrust=None):
        """Time, angle from the command and angle from the hover [deg], and V, every 20 ms."""
        rows = []
        for k in range(round(seconds / 0.02)):
            self.steer(q, thrust)
            self.vehicle.advance(10)
            rows.append((0.02 * (k + 1), self.off(q), self.off(hover(0.0)), self.vehicle.lyapunov_attitude))
        return np.array(rows).T

    def off(self, q):
        return math.degrees(2.0 * math.acos(min(1.0, abs(multiply(conjugate(q), self.vehicle.plant[Q:W].copy())[0]))))

    def let_go(self):
        p, v = self.vehicle.plant[P : P + 3], self.vehicle.plant[V : V + 3]
        self.vehicle.set_target(Setpoint(tuple(p + 0.5 * v), 0.0, 3.0))

    @property
    def names(self):
        return [jump.name for jump in self.vehicle.jumps]


# Following


@pytest.mark.parametrize("wind", [STILL, HEAD_WIND, SPAN_WIND], ids=["calm", "head wind", "span wind"])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("deg", [10.0, -10.0, 30.0, -30.0])
def test_steps_are_followed_within_a_second(axis, deg, wind):
    steered = Steered(wind)
    q = tilted(axis, deg)
    time, off, turned, v = steered.fly(q, 3.0)
    band = 0.05 * abs(deg)
    assert steered.names[-1] == "steer"
    assert time[np.flatnonzero(off > band)[-1]] < 0.85
    assert off[-1] < 0.3
    # Overshoot, in degrees; into a head wind it hovers at 11 deg and begins from there.
    assert (turned - abs(deg)).max() < (0.03 * abs(deg) if wind is not HEAD_WIND else 1.0)
    assert np.nanmax(v) < 0.02 * LOST


def test_a_tilt_of_45_deg_is_held_while_the_speed_grows():
    steered = Steered()
    _, off, _, _ = steered.fly(tilted("y", -45.0), 1.3)
    assert np.linalg.norm(steered.vehicle.plant[V:Q]) > MAX_SPEED
    assert off[-1] < 1.0


def test_a_turn_is_fed_forward():
    steered = Steered()
    rate, q = np.radians(60.0), hover(0.0)
    for _ in range(100):
        steered.steer(q, rates=(rate, 0.0, 0.0))
        steered.vehicle.advance(10)
        q = multiply(q, from_rotation_vector(np.array((0.02 * rate, 0.0, 0.0))))
    assert steered.off(q) < 2.0
    assert steered.vehicle.plant[W] == pytest.approx(rate, abs=0.01)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_v_falls_from_every_disturbance_until_it_is_gone(axis):
    """Knocked by 40 deg and spinning: V is the energy of the error, and the loop takes it away."""
    steered = Steered()
    q = hover(0.0)
    steered.fly(q, 0.5)
    steered.vehicle.plant[Q:W] = tilted(axis, 40.0)
    steered.vehicle.plant[W + "xyz".index(axis)] = 0.5
    values = []
    for _ in range(400):
        steered.steer(q)
        steered.vehicle.advance(1)
        values.append(steered.vehicle.lyapunov_attitude)
    values = np.array(values)
    assert 0.2 < values[0] < LOST
    assert values[-1] < 2e-4
    # So much more while the elevons are on their way to their stops, which such a knock takes.
    assert (values - np.minimum.accumulate(values)).max() < 0.08 * values[0]
    assert steered.names[-1] == "steer"


# Entering and leaving


@pytest.mark.parametrize("wind", [STILL, HEAD_WIND], ids=["calm", "head wind"])
@pytest.mark.parametrize(("axis", "deg"), [("y", 30.0), ("z", 30.0), ("y", -45.0), ("z", 45.0)])
def test_neither_entering_nor_leaving_steps_the_actuators(axis, deg, wind):
    steered = Steered(wind)
    q = tilted(axis, deg)
    commands = [steered.vehicle.command.copy()]
    for tick in range(800):
        steered.steer(q) if tick < 300 else steered.let_go()
        steered.vehicle.advance(1)
        commands.append(steered.vehicle.command.copy())
    step = np.abs(np.diff(commands, axis=0))
    assert "let_go" in steered.names
    for jump in ("steer", "let_go"):
        number = steered.names.index(jump)
        at = round((steered.vehicle.jumps[number].time - 5.0) / 0.002)
        assert step[max(at - 1, 0) : at + 3, :2].max() < 12.0  # rad/s, of 690
        assert np.degrees(step[max(at - 1, 0) : at + 3, 2:].max()) < 4.0


@pytest.mark.parametrize("axis", ["y", "z"])
@pytest.mark.parametrize("deg", [10.0, 45.0])
@pytest.mark.parametrize("speed", [2.0, MAX_SPEED])
def test_within_the_limits_the_hover_is_found_again_without_losing_height(axis, deg, speed):
    steered = Steered()
    q = tilted(axis, deg)
    while np.linalg.norm(steered.vehicle.plant[V:Q]) < speed and steered.vehicle.time < 20.0:
        steered.fly(q, 0.02)
    high = steered.vehicle.plant[P + 2]
    steered.let_go()
    lowest = high
    for _ in range(250):
        steered.vehicle.advance(10)
        lowest = min(lowest, steered.vehicle.plant[P + 2])
    assert lowest > high - 0.1
    assert steered.names[-2:] == ["let_go", "enter_linear"]
    assert np.linalg.norm(steered.vehicle.plant[V:Q]) < 0.3


def test_a_sink_at_the_limit_is_arrested_within_what_is_kept_for_it():
    steered = Steered()
    q = tilted("y", 10.0)
    while steered.vehicle.plant[V + 2] > -MAX_SINK:
        steered.fly(q, 0.02, MIN_THRUST)
    high = steered.vehicle.plant[P + 2]
    steered.let_go()
    steered.vehicle.advance(1500)
    assert high - 0.8 * MAX_SINK < min(steered.vehicle.plant[P + 2], high)


def test_an_upset_is_left_for_the_zero_moment_law():
    steered = Steered()
    steered.fly(hover(0.0), 0.5)
    steered.vehicle.plant[Q:W] = tilted("z", 70.0)
    steered.vehicle.advance(1)
    steered.let_go()
    steered.vehicle.advance(2000)
    assert "upset" in steered.names
    assert steered.vehicle.law is Law.HOVER_LINEAR


def test_in_a_wind_it_is_entered_from_the_law_that_holds_there():
    steered = Steered((-6.0, 0.0, 0.0), law=Law.TO_HOVER)
    assert steered.vehicle.law is Law.TO_HOVER
    _, off, _, _ = steered.fly(tilted("y", -20.0), 2.0)
    assert steered.names[-1] == "steer"
    assert off[-1] < 1.0


def test_the_same_seed_flies_the_same_bits():
    flown = []
    for _ in range(2):
        steered = Steered(HEAD_WIND, seed=7, gusts=1.0)
        steered.fly(tilted("y", 20.0), 2.0)
        flown.append(steered.vehicle.plant.tobytes() + steered.vehicle.memory.tobytes())
    assert flown[0] == flown[1]


@pytest.mark.parametrize("heading", [0.0, 2.0])
@pytest.mark.parametrize("acceleration", [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, -3.0, 1.0), (1.0, 1.0, -2.0)])
def test_an_acceleration_is_the_force_of_its_attitude(acceleration, heading):
    attitude = attitude_of(acceleration, heading, 0.0, NOMINAL)
    force = attitude.thrust * full_force(NOMINAL) * rotate(np.array(attitude.q), NOSE)
    assert force / NOMINAL.m - np.array((0.0, 0.0, NOMINAL.g)) == pytest.approx(np.array(acceleration))


# On the wire


class Streaming(Ground):
    """A program that streams attitudes; angles as ATTITUDE has them, pitch 90 deg in the hover."""

    def attitude(self, pitch=90.0, roll=0.0, yaw=0.0, thrust=HOVER, mask=0b111, rates=(0.0, 0.0, 0.0), q=None):
        q = quaternion_from_euler(*np.radians((roll, pitch, yaw))) if q is None else q
        self.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, list(q), *rates, thrust))

    def start(self):
        self.attitude()
        return self.command(mavlink.MAV_CMD_DO_SET_MODE, 1, *Mode.OFFBOARD.value)

    def stream(self, seconds, **attitude):
        for _ in range(round(seconds / 0.04)):
            self.attitude(**attitude)
            self.advance(0.04)

    @property
    def mode(self):
        return self.node.craft.autopilot.mode


@pytest.fixture
def streaming(tmp_path):
    return Streaming(tmp_path, airborne=True)


def test_a_height_is_held_by_a_program_that_sends_thrust(streaming):
    assert streaming.start() == mavlink.MAV_RESULT_ACCEPTED
    for _ in range(150):
        seen = streaming.last("LOCAL_POSITION_NED")
        streaming.stream(0.04, thrust=HOVER * (1.0 + 0.25 * (4.0 + seen.z) + 0.3 * seen.vz))
    assert streaming.last("LOCAL_POSITION_NED").z == pytest.approx(-4.0, abs=0.02)
    told = streaming.last("DARKO_HYBRID_STATE")
    assert told.law == Law.HOVER_ATTITUDE
    assert told.v_attitude < 1e-5
    assert streaming.last("DARKO_ENERGY").energy_attitude > 500.0


@pytest.mark.parametrize(
    ("pitch", "yaw", "north", "east"), [(80.0, 0.0, 1, 0), (100.0, 0.0, -1, 0), (80.0, 90.0, 0, 1)]
)
def test_pitching_down_from_90_deg_goes_where_the_belly_looks(streaming, pitch, yaw, north, east):
    streaming.start()
    streaming.stream(2.0, pitch=90.0, yaw=yaw)
    streaming.stream(1.0, pitch=pitch, yaw=yaw)
    seen = streaming.last("LOCAL_POSITION_NED")
    assert (round(seen.vx), round(seen.vy)) == (north, east)
    assert streaming.last("ATTITUDE").pitch == pytest.approx(math.radians(min(pitch, 180.0 - pitch)), abs=0.01)


def test_when_the_stream_stops_it_holds(streaming):
    streaming.start()
    streaming.stream(1.0, pitch=75.0)
    streaming.advance(1.0)
    assert streaming.mode is Mode.HOLD
    assert "Set-points stopped: holding" in streaming.texts()
    streaming.advance(4.0)
    assert np.linalg.norm(streaming.vehicle.plant[V:Q]) < 0.2
    assert [jump.name for jump in streaming.vehicle.jumps] == ["steer", "let_go", "enter_linear"]


@pytest.mark.parametrize(("action", "mode"), [(3, Mode.RTL), (4, Mode.LAND), (5, Mode.HOLD)])
def test_what_is_done_then_is_the_parameter_s(streaming, action, mode):
    streaming.node.craft.autopilot.apply(Settings(setpoint_action=action))
    streaming.start()
    streaming.stream(0.6, pitch=80.0)
    streaming.advance(0.6)
    assert streaming.mode is mode


def test_another_set_point_takes_over_without_leaving_offboard(streaming):
    streaming.start()
    streaming.stream(1.0, pitch=80.0)
    for _ in range(50):
        streaming.send(
            mavlink.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, 1, 0b0000_1101_1111_1000, 2.0, 0.0, -4.0, 0, 0, 0, 0, 0, 0, 0, 0
            )
        )
        streaming.advance(0.1)
    assert streaming.mode is Mode.OFFBOARD
    assert streaming.vehicle.plant[:3] == pytest.approx([2.0, 0.0, 4.0], abs=0.2)


@pytest.mark.parametrize(
    ("attitude", "said"),
    [
        ({"pitch": 44.0}, "46 deg from the vertical"),
        ({"pitch": 0.0}, "90 deg from the vertical: attitudes are flown up to 45 deg"),
        ({"q": (0.5, 0.0, 0.5, 0.0)}, "norm 0.71"),
        ({"q": (math.nan, 0.0, 0.7, 0.0)}, "not a number"),
        ({"thrust": math.nan}, "not a number"),
        ({"thrust": 1.2}, "thrust 1.20 is not within"),
        ({"thrust": -0.1}, "thrust -0.10 is not within"),
        ({"thrust": 0.25}, "thrust 0.25 is not within 0.3 and 1"),
        ({"mask": 0b1000_0000, "rates": (0.1, 0.0, 0.0)}, "body rates alone"),
        ({"mask": 0b0100_0111}, "thrust along the nose"),
        ({"mask": 0b0010_0111}, "thrust along the nose"),
        ({"mask": 0, "rates": (math.inf, 0.0, 0.0)}, "not a number"),
        ({"mask": 0, "rates": (4.0, 0.0, 0.0)}, "body rates of 4.0 rad/s"),
    ],
)
def test_what_cannot_be_flown_is_refused_in_words_and_changes_nothing(streaming, attitude, said):
    streaming.start()
    streaming.stream(0.4)
    before = streaming.node.craft.autopilot._guidance
    streaming.attitude(**attitude)
    assert said in streaming.texts()
    assert streaming.node.craft.autopilot._guidance is before
    streaming.stream(1.0, **attitude)
    assert streaming.mode is Mode.HOLD  # nothing that could be flown came any more


def test_masked_rates_are_not_looked_at(streaming):
    streaming.start()
    streaming.stream(0.5, mask=0b111, rates=(math.nan, math.nan, math.nan))
    assert streaming.mode is Mode.OFFBOARD


def test_on_the_ground_it_asks_for_a_take_off(tmp_path):
    ground = Streaming(tmp_path)
    assert ground.start() == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "take off first" in ground.texts()


def test_on_the_wing_it_asks_for_the_hover():
    flight = Flight()
    flight.autopilot.circle((60.0, 40.0, 25.0), 40.0)
    flight.fly_until(lambda: flight.vehicle.law is Law.FORWARD_LINE_OF_SIGHT, 20.0)
    upright = Attitude(tuple(hover(0.0)), (0.0, 0.0, 0.0), HOVER)
    assert "go over to the hover first" in flight.autopilot.set_offboard_attitude(upright)
    assert not flight.autopilot.set_mode(Mode.OFFBOARD).accepted
    assert flight.autopilot.mode is Mode.HOLD


# Failsafes


class Program(Flight):
    """A craft whose attitude set-points never stop."""

    def __init__(self, q, thrust=None, settings=None):
        super().__init__(settings=settings)
        self.attitude = Attitude(tuple(q), (0.0, 0.0, 0.0), thrust_at(q) if thrust is None else thrust)
        self.stream()
        assert self.autopilot.set_mode(Mode.OFFBOARD).accepted

    def stream(self):
        self.autopilot.set_offboard_attitude(self.attitude)

    def fly_out(self, limit):
        """Fly until OFFBOARD is left, then for 6 s."""
        self.fly_while(lambda: self.autopilot.mode is Mode.OFFBOARD, limit)
        self.fly(6.0, self.stream)

    def fly_while(self, condition, limit):
        end = self.vehicle.time + limit
        while condition():
            assert self.vehicle.time < end
            self.fly(0.02, self.stream)


@pytest.mark.parametrize(
    ("q", "thrust", "said"),
    [
        (tilted("y", -20.0), None, "too fast for attitude set-points: holding"),
        (hover(0.0), 0.8, "Climbing at 4."),
        (hover(0.0), 1.0, "Climbing at 4."),
        (hover(0.0), MIN_THRUST, "Sinking at 3."),
        (hover(0.0), 0.99 * HOVER, "too low for attitude set-points: holding"),
    ],
)
def test_what_leads_out_of_the_limits_ends_in_a_hold(q, thrust, said):
    program = Program(q, thrust)
    program.fly_out(40.0)
    assert program.autopilot.mode is Mode.HOLD
    assert any(said in text for text in program.said)
    assert program.p[:, 2].min() > 0.9
    assert np.linalg.norm(program.v[-1]) < 0.5


def test_it_is_not_taken_up_again_unasked():
    program = Program(tilted("y", -20.0))
    program.fly_out(40.0)
    assert program.names.count("steer") == 1


def test_a_fence_ends_it_before_it_is_crossed_far():
    program = Program(tilted("y", -10.0), settings=Settings(fence_action=3, fence_reach=10.0))
    program.autopilot.load_fence(Fence())
    program.fly_while(lambda: program.autopilot.mode is Mode.OFFBOARD, 30.0)
    assert program.autopilot.mode is Mode.RTL
    program.fly(1.0, program.stream)
    assert np.hypot(*program.p[-1, :2]) < 14.0
    assert any("Fence" in text for text in program.said)


def test_an_empty_battery_ends_it():
    program = Program(hover(0.0))
    program.fly(1.0, program.stream)
    program.craft.bind(program.craft.bindings.replaced({"SIM_BAT_ENERGY": program.vehicle.energy / 0.94}))
    program.fly(2.0, program.stream)
    assert program.autopilot.mode is Mode.LAND
    assert any("Battery critical" in text for text in program.said)


def test_an_upset_ends_it_in_words():
    program = Program(hover(0.0))
    program.fly(0.5, program.stream)
    program.vehicle.plant[Q:W] = tilted("z", 70.0)
    program.fly(6.0, program.stream)
    assert program.autopilot.mode is Mode.HOLD
    assert any("Attitude lost: holding" in text for text in program.said)
    assert program.vehicle.law is Law.HOVER_LINEAR


def test_motors_at_their_limits_are_the_whole_thrust():
    steered = Steered()
    steered.fly(hover(0.0), 0.6, 1.0)
    assert steered.vehicle.plant[ACTUATOR : ACTUATOR + 2] == pytest.approx([NOMINAL.omega_max] * 2, rel=0.03)
