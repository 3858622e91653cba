"""Streamed positions are flown in the hover and after a leg flown forward, and so are their headings."""

import math

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law, LegMode, Regime
from protocol.names import Mode
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import Fence
from sitl.control.hover_attitude import full_force
from sitl.control.reference import AttitudeReference
from sitl.guidance.setpoints import MIN_THRUST, HeadingSetpoint
from sitl.model.quaternions import hover, x_axis
from sitl.model.vectors import Vector
from sitl.simulation.situation import regime
from tests.support.flights.estimates import turned
from tests.support.flights.recorded_flight import HIGH, NOMINAL, Flight


class Streamed:
    """A vehicle in OFFBOARD, and the position that is streamed to it."""

    def __init__(self, point, heading=None):
        self.flight, self.point, self.heading = Flight(settings=Settings(leg_mode=LegMode.FORWARD)), point, heading
        self.was_forward = False
        self.send()
        assert self.flight.autopilot.set_mode(Mode.OFFBOARD).accepted

    def send(self):
        assert self.flight.autopilot.offboard.set_position(self.point, HeadingSetpoint(self.heading)) is None

    def fly(self, seconds, until=lambda: False):
        end = self.flight.vehicle.time + seconds
        while self.flight.vehicle.time < end and not until():
            self.send()
            self.flight.fly(0.1)
            self.was_forward |= self.view.forward

    @property
    def view(self):
        return self.flight.aircraft.view()

    @property
    def off(self):
        """Distance from the point [m]."""
        return math.dist(self.view.p, self.point)

    @property
    def turn(self):
        """To the heading [rad]."""
        return abs(math.remainder(self.view.heading - self.heading, math.tau))


@pytest.fixture(scope="module")
def arrived():
    """Hovering at the end of a leg that was flown forward."""
    stream = Streamed((120.0, 0.0, HIGH))
    stream.fly(40.0, until=lambda: stream.was_forward and stream.off < 0.5)
    stream.fly(3.0)
    assert stream.off < 0.7
    return stream


@pytest.mark.parametrize("point", [(120.0, -1.0, HIGH), (120.0, -4.5, HIGH), (120.0, 0.0, HIGH + 4.0)])
def test_after_a_leg_flown_forward_small_steps_are_flown(arrived, point):
    arrived.point = point
    arrived.fly(12.0, until=lambda: arrived.off < 0.3)
    assert arrived.off < 0.3


def test_after_a_leg_flown_forward_a_heading_is_turned_to(arrived):
    arrived.heading = math.radians(-90.0)
    arrived.fly(12.0, until=lambda: arrived.turn < 0.1)
    assert arrived.turn < 0.1


def test_a_position_that_moves_on_the_way_is_arrived_at_with_its_heading():
    stream = Streamed((90.0, 0.0, HIGH), heading=math.radians(60.0))
    stream.fly(40.0, until=lambda: stream.was_forward and stream.view.p[0] > 40.0)
    stream.point = (90.0, -3.0, HIGH + 3.0)
    stream.fly(30.0, until=lambda: stream.off < 0.4 and not stream.view.forward)
    stream.fly(4.0)
    assert stream.off < 0.5
    assert stream.turn < 0.15


# Streamed attitudes: when they are refused, and what ends them while they still arrive.


HOVER = NOMINAL.m * NOMINAL.g / full_force(NOMINAL)  # thrust of a hover
STILL = Vector(0.0, 0.0, 0.0)


def tilted(axis, deg):
    """The hover turned about a body axis."""
    return turned(hover(0.0), np.radians(deg) * np.eye(3)["xyz".index(axis)])


def test_in_forward_flight_a_transition_is_asked_for_first():
    flight = Flight()
    flight.autopilot.guided.circle((60.0, 40.0, 25.0), 40.0)
    flight.fly_until(lambda: regime(flight.vehicle) is Regime.FORWARD, 20.0)
    upright = AttitudeReference(hover(0.0), STILL, HOVER)
    assert "make a transition to hover first" in flight.autopilot.offboard.set_attitude(upright)
    assert not flight.autopilot.set_mode(Mode.OFFBOARD).accepted
    assert flight.autopilot.mode is Mode.HOLD


class Program(Flight):
    """An aircraft whose attitude set-points never stop."""

    def __init__(self, q, thrust=None, settings=None):
        super().__init__(settings=settings)
        self.attitude = AttitudeReference(q, STILL, HOVER / x_axis(q).z if thrust is None else thrust)
        self.stream()
        assert self.autopilot.set_mode(Mode.OFFBOARD).accepted

    def stream(self):
        self.autopilot.offboard.set_attitude(self.attitude)

    def fly_out(self, limit):
        """Fly until OFFBOARD is left, then for 6 s."""
        self.fly_while(lambda: self.autopilot.mode is Mode.OFFBOARD, limit)
        self.fly(6.0, self.stream)

    def fly_while(self, condition, limit):
        end = self.vehicle.time + limit
        while condition():
            assert self.vehicle.time < end
            self.fly(0.02, self.stream)


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("q", "thrust", "reason"),
    [
        (tilted("y", -20.0), None, "too fast for attitude set-points: holding"),
        (hover(0.0), 0.8, "Climbing at 4."),
        (hover(0.0), 1.0, "Climbing at 4."),
        (hover(0.0), MIN_THRUST, "Sinking at 3."),
        (hover(0.0), 0.99 * HOVER, "too low for attitude set-points: holding"),
    ],
)
def test_an_attitude_that_leads_out_of_the_limits_ends_in_a_hold(q, thrust, reason):
    program = Program(q, thrust)
    program.fly_out(40.0)
    assert program.autopilot.mode is Mode.HOLD
    assert any(reason in text for text in program.texts)
    assert program.p[:, 2].min() > 0.9
    assert np.linalg.norm(program.v[-1]) < 0.5


def test_it_is_not_flown_again_without_a_request():
    program = Program(tilted("y", -20.0))
    program.fly_out(40.0)
    assert program.names.count("steer") == 1


def test_a_fence_ends_it_soon_after_the_breach():
    program = Program(tilted("y", -10.0), settings=Settings(fence_action=3, fence_distance=10.0))
    program.autopilot.load_fence(Fence())
    program.fly_while(lambda: program.autopilot.mode is Mode.OFFBOARD, 30.0)
    assert program.autopilot.mode is Mode.RTL
    program.fly(1.0, program.stream)
    assert np.hypot(*program.p[-1, :2]) < 14.0
    assert any("Fence" in text for text in program.texts)


def test_an_empty_battery_ends_it():
    program = Program(hover(0.0))
    program.fly(1.0, program.stream)
    program.aircraft.configure(
        program.aircraft.configuration.replaced({"SIM_BAT_ENERGY": program.vehicle.energy / 0.94})
    )
    program.fly(2.0, program.stream)
    assert program.autopilot.mode is Mode.LAND
    assert any("Battery critical" in text for text in program.texts)


def test_an_upset_ends_it_with_a_reason():
    program = Program(hover(0.0))
    program.fly(0.5, program.stream)
    program.vehicle.place(program.vehicle.truth.body._replace(attitude=tilted("z", 70.0)))
    program.fly(6.0, program.stream)
    assert program.autopilot.mode is Mode.HOLD
    assert any("Attitude lost: holding" in text for text in program.texts)
    assert program.vehicle.law is Law.HOVER_LINEAR
