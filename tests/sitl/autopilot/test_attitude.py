"""Streamed attitudes: the one an acceleration takes, and what ends them while they still come."""

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from protocol.modes import Mode
from sitl.autopilot.attitude import MIN_THRUST, attitude_of
from sitl.autopilot.fence import Fence
from sitl.autopilot.settings import Settings
from sitl.control.hover_attitude import full_force
from sitl.control.reference import AttitudeReference
from sitl.model.quaternions import hover, x_axis
from sitl.model.vectors import Vector
from tests.support.estimates import turned
from tests.support.wing_flight import NOMINAL, Flight

HOVER = NOMINAL.m * NOMINAL.g / full_force(NOMINAL)  # thrust of a hover
STILL = Vector(0.0, 0.0, 0.0)


def tilted(axis, deg):
    """The hover turned about a body axis."""
    return turned(hover(0.0), np.radians(deg) * np.eye(3)["xyz".index(axis)])


@pytest.mark.parametrize("heading", [0.0, 2.0])
@pytest.mark.parametrize("acceleration", [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, -3.0, 1.0), (1.0, 1.0, -2.0)])
def test_an_acceleration_is_the_force_of_its_attitude(acceleration, heading):
    attitude = attitude_of(acceleration, heading, 0.0, NOMINAL)
    force = attitude.thrust * full_force(NOMINAL) * np.array(x_axis(attitude.attitude))
    assert force / NOMINAL.m - np.array((0.0, 0.0, NOMINAL.g)) == pytest.approx(np.array(acceleration))


def test_on_the_wing_it_asks_for_the_hover():
    flight = Flight()
    flight.autopilot.circle((60.0, 40.0, 25.0), 40.0)
    flight.fly_until(lambda: flight.vehicle.law is Law.FORWARD_LINE_OF_SIGHT, 20.0)
    upright = AttitudeReference(hover(0.0), STILL, HOVER)
    assert "go over to the hover first" in flight.autopilot.set_offboard_attitude(upright)
    assert not flight.autopilot.set_mode(Mode.OFFBOARD).accepted
    assert flight.autopilot.mode is Mode.HOLD


class Program(Flight):
    """A craft whose attitude set-points never stop."""

    def __init__(self, q, thrust=None, settings=None):
        super().__init__(settings=settings)
        self.attitude = AttitudeReference(q, STILL, HOVER / x_axis(q).z if thrust is None else thrust)
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
    program.vehicle.place(program.vehicle.truth.body._replace(attitude=tilted("z", 70.0)))
    program.fly(6.0, program.stream)
    assert program.autopilot.mode is Mode.HOLD
    assert any("Attitude lost: holding" in text for text in program.said)
    assert program.vehicle.law is Law.HOVER_LINEAR
