"""Streamed positions are flown in the hover and after a leg flown forward, and so are their headings."""

import math

import pytest

from protocol.dialect.vocabulary import LegMode
from protocol.names.modes import Mode
from sitl.autopilot.settings import Settings
from sitl.guidance.setpoints import HeadingSetpoint
from tests.support.flights.recorded_flight import HIGH, Flight


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
