"""A change of height while the vehicle circles keeps it circling, forward, at the new height."""

import math

import pytest

from protocol.dialect.vocabulary import LegMode
from protocol.names import Mode
from sitl.autopilot.settings import Settings
from sitl.guidance.circles import FlyCircle
from sitl.vehicle.aircraft import is_forward
from tests.support.flights.recorded_flight import HIGH, Flight
from tests.support.vehicle.mission_items import item

CENTRE, RADIUS = (60.0, 0.0, HIGH), 40.0


def orbit(flight):
    assert flight.autopilot.guided.circle(CENTRE, RADIUS).accepted


def circle_after_a_front_transition(flight):
    flight.autopilot.transitions.begin(LegMode.FORWARD)


def loiter_in_a_mission(flight):
    flight.autopilot.missions.load((item(17, *CENTRE, params=(0.0, 0.0, RADIUS, math.nan)),))
    assert flight.autopilot.missions.start().accepted


def heights_after(flight, seconds):
    """Fly on in forward flight; returns the heights flown."""
    first = len(flight.p)

    def stays_forward():
        assert is_forward(flight.vehicle)

    flight.fly(seconds, stays_forward)
    return flight.p[first:, 2]


@pytest.mark.parametrize("begin", [orbit, circle_after_a_front_transition, loiter_in_a_mission])
def test_the_circle_is_flown_on_at_the_new_height(begin):
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD))
    begin(flight)
    flight.fly(14.0)
    before = flight.autopilot.reference.path
    assert flight.autopilot.guided.change_height(HIGH + 12.0).accepted
    assert flight.autopilot.mode is Mode.HOLD
    heights = heights_after(flight, 14.0)
    assert heights.min() > HIGH - 3.0
    assert heights[-50:] == pytest.approx(HIGH + 12.0, abs=2.0)
    path = flight.autopilot.reference.path
    assert (path.start[:2], path.radius, path.airspeed) == (before.start[:2], before.radius, before.airspeed)
    away = math.dist(flight.p[-1][:2], path.start[:2])
    assert away == pytest.approx(abs(path.radius), abs=6.0)


def test_it_sinks_as_well_and_a_height_that_cannot_be_circled_is_refused():
    flight = Flight()
    orbit(flight)
    flight.fly(12.0)
    guided = flight.autopilot.guided
    circle = flight.autopilot.manoeuvre
    assert "too low to circle" in guided.change_height(1.0).text
    assert "Height denied" in guided.change_height(1e5).text
    assert "Height denied" in guided.change_height(math.nan).text
    assert "in forward flight" in guided.change_height(HIGH, speed=2.0).text
    assert flight.autopilot.manoeuvre is circle
    assert guided.change_height(HIGH - 10.0).accepted
    heights = heights_after(flight, 14.0)
    assert heights.min() > HIGH - 13.0
    assert heights[-50:] == pytest.approx(HIGH - 10.0, abs=2.0)


def test_a_heading_is_turned_to_in_the_hover():
    flight = Flight()
    orbit(flight)
    flight.fly(1.0)
    assert flight.autopilot.guided.change_height(HIGH, heading=1.0).accepted
    assert not isinstance(flight.autopilot.manoeuvre, FlyCircle)
