"""A change of speed reaches the way of flying that is under way, and is refused for the other."""

import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Way
from sitl.autopilot.settings import Settings
from tests.support.flights.recorded_flight import HIGH, Flight

GROUND = mavlink.SPEED_TYPE_GROUNDSPEED


@pytest.fixture
def forward():
    """On a leg flown forward, to hover at its end."""
    flight = Flight(settings=Settings(way=Way.FORWARD))
    assert flight.autopilot.guided.go_to((120.0, 0.0, HIGH)).accepted
    flight.fly(0.1)
    assert flight.autopilot.reference.forward
    return flight


def test_on_the_leg_the_airspeed_is_changed(forward):
    guided = forward.autopilot.guided
    assert "Hover speed 2 m/s refused: in forward flight" in guided.change_speed(GROUND, 2.0).text
    assert guided.change_speed(GROUND, 17.0).accepted
    forward.fly(0.1)
    assert forward.autopilot.reference.path.airspeed == 17.0


def test_hovering_at_its_end_the_speed_of_the_hover_is_changed(forward):
    guided = forward.autopilot.guided
    forward.fly_until(lambda: not forward.autopilot.reference.forward, 60.0)
    assert "Speed 17 m/s refused: not in forward flight" in guided.change_speed(GROUND, 17.0).text
    assert guided.change_speed(GROUND, 1.5).accepted
    forward.fly(0.1)
    assert forward.autopilot.reference.speed == 1.5
    assert not forward.autopilot.reference.forward
