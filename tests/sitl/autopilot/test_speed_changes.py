"""A change of speed reaches the way of flying that is under way, and is refused for the other."""

import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from sitl.autopilot.settings import Settings
from tests.support.flights.recorded_flight import HIGH, Flight
from tests.support.vehicle.mission_items import item, waypoint

AIR, GROUND = mavlink.SPEED_TYPE_AIRSPEED, mavlink.SPEED_TYPE_GROUNDSPEED
CLIMB, DESCENT = mavlink.SPEED_TYPE_CLIMB_SPEED, mavlink.SPEED_TYPE_DESCENT_SPEED


@pytest.fixture
def forward():
    """On a leg flown forward, to hover at its end."""
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD))
    assert flight.autopilot.guided.go_to((120.0, 0.0, HIGH)).accepted
    flight.fly(0.1)
    assert flight.autopilot.reference.forward
    return flight


def test_on_the_leg_the_airspeed_is_changed(forward):
    guided = forward.autopilot.guided
    assert "Hover speed 2 m/s refused: in forward flight" in guided.change_speed(GROUND, 2.0).text
    assert guided.change_speed(AIR, 17.0).accepted
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


def test_over_the_ground_the_airspeed_is_that_which_the_wind_leaves():
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD), wind_speed=4.0, wind_from=0.0)
    flight.fly(5.0)  # the wind is estimated
    guided = flight.autopilot.guided
    assert guided.go_to((300.0, 0.0, HIGH)).accepted
    flight.fly(12.0)
    assert guided.change_speed(AIR, 12.0).accepted
    assert flight.autopilot.manoeuvre.reference.path.airspeed == 12.0
    assert guided.change_speed(GROUND, 12.0).accepted
    assert flight.autopilot.manoeuvre.reference.path.airspeed == pytest.approx(16.0, abs=1.0)
    assert "needs an airspeed of" in guided.change_speed(GROUND, 21.0).text
    flight.fly(4.0)
    assert flight.v[-1][0] == pytest.approx(12.0, abs=1.0)


def test_in_a_mission_a_ground_speed_is_flown_against_the_wind():
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD), wind_speed=4.0, wind_from=0.0)
    speed = item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(GROUND, 12.0, -1.0, 0.0))
    flight.autopilot.missions.load((speed, waypoint(300, 0, HIGH)))
    flight.fly(5.0)
    flight.autopilot.missions.start()
    flight.fly(14.0)
    assert flight.v[-1][0] == pytest.approx(12.0, abs=1.0)
    flight.autopilot.guided.change_speed(AIR, 12.0)
    flight.fly(4.0)
    assert flight.v[-1][0] == pytest.approx(8.0, abs=1.0)


def test_new_settings_are_flown_at_once_unless_another_speed_was_asked_for(forward):
    def configure(**changed):
        forward.autopilot.configure(forward.autopilot.settings._replace(**changed))
        forward.fly(0.1)
        return forward.autopilot.reference

    assert configure(airspeed=17.0).path.airspeed == 17.0
    assert configure(hover_speed=2.0).speed == 2.0
    assert forward.autopilot.guided.change_speed(AIR, 12.0).accepted
    assert configure(airspeed=15.0).path.airspeed == 12.0
    assert forward.autopilot.guided.go_to((10.0, 0.0, HIGH), speed=1.0).accepted
    assert configure(hover_speed=3.0).speed == 1.0
    assert configure(hover_speed=0.5).speed == 0.5


def test_a_return_flies_at_the_new_airspeed():
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD))
    assert flight.autopilot.guided.go_to((200.0, 0.0, HIGH)).accepted
    flight.fly(12.0)
    assert flight.autopilot.guided.return_to_launch().accepted
    flight.fly(0.1)
    assert flight.autopilot.guided.change_speed(AIR, 12.0).accepted
    flight.fly(0.1)
    assert flight.autopilot.reference.path.airspeed == 12.0


@pytest.mark.parametrize(("kind", "up", "rate"), [(CLIMB, 6.0, 0.5), (DESCENT, -6.0, -0.5)])
def test_a_vertical_speed_holds_on_a_hovered_leg(kind, up, rate):
    flight = Flight(settings=Settings(leg_mode=LegMode.HOVER))
    guided = flight.autopilot.guided
    assert guided.go_to((12.0, 0.0, HIGH + up)).accepted
    assert guided.change_speed(kind, abs(rate)).accepted
    flight.fly(8.0)
    assert flight.v[150:, 2] == pytest.approx(rate, abs=0.15)
    assert guided.change_speed(kind, -2.0).accepted
    flight.fly(5.0)
    assert flight.p[-1][2] == pytest.approx(HIGH + up, abs=0.3)
