"""Links lost in flight: each kind of flight with each action, and what else happens in the same second."""

import numpy as np
import pytest

from protocol.names import Mode
from sitl.autopilot.answers import CONTINUING, DOING, SafetyAction
from tests.support.flights import failsafe_flights as flights
from tests.support.flights.failsafe_flights import FORWARD, HOVER, MODE_OF_ACTION, SITUATIONS, TIMEOUT

HOLD, RETURN, LAND = SafetyAction.HOLD, SafetyAction.RETURN, SafetyAction.LAND
ACTIONS = (HOLD, RETURN, LAND)
AFTER = TIMEOUT + 0.1  # until a loss is noticed [s]
TEXTS = {"ground": "No ground station for 2 s", "companion": "No companion for 2 s"}


def lose(flight, action, link="ground"):
    """Lose a link and fly until the loss is noticed."""
    field = "link_action" if link == "ground" else "companion_action"
    flight.autopilot.configure(flight.autopilot.settings._replace(**{field: int(action)}))
    flight.lose(link)
    flight.fly(AFTER)


# Each kind of flight, each action


@pytest.mark.long(after=1)
@pytest.mark.parametrize("action", ACTIONS, ids=lambda action: action.name)
@pytest.mark.parametrize("situation", SITUATIONS, ids=lambda situation: situation.start.__name__)
def test_a_lost_link_starts_the_set_action_unless_something_as_grave_is_under_way(situation, action):
    link = list(TEXTS)[int(action) % 2]
    flight = situation.start(FORWARD)
    before = flight.modes[-1]
    lose(flight, action, link)
    flight.fly(1.5)
    graver = action <= situation.under_way
    doing = CONTINUING[situation.under_way] if graver else DOING[action]
    assert flight.alarms == [f"{TEXTS[link]}: {doing}"]
    assert flight.autopilot.mode is (before if graver else MODE_OF_ACTION[action])
    changes = flight.modes[flight.modes.index(before) + 1 :]
    assert changes == [] if graver or before is MODE_OF_ACTION[action] else [MODE_OF_ACTION[action]]  # nothing flips
    assert not flight.failsafes
    assert flight.p[-1, 2] > 0.5


def test_the_action_none_changes_nothing():
    flight = flights.on_forward_mission(FORWARD)
    lose(flight, SafetyAction.NONE)
    assert flight.alarms == ["No ground station for 2 s: going on"]
    assert flight.autopilot.mode is Mode.MISSION


# To the end


def test_a_take_off_that_loses_its_link_comes_home():
    flight = flights.taking_off(HOVER._replace(return_altitude=6.0))
    lose(flight, RETURN)
    flight.land(60.0)
    assert np.linalg.norm(flight.p[-1, :2]) < 0.5
    assert 5.0 < flight.p[:, 2].max() < 9.0  # no higher than the return needs


def test_a_front_transition_that_loses_its_link_comes_home():
    flight = flights.in_front_transition(FORWARD)
    lose(flight, RETURN)
    flight.land(60.0)
    assert flight.p[:, 0].max() < 35.0
    assert np.linalg.norm(flight.p[-1, :2]) < 0.5


def test_a_take_off_that_loses_its_link_lands_below():
    flight = flights.taking_off(FORWARD)
    lose(flight, LAND)
    flight.land(30.0)
    assert np.linalg.norm(flight.p[-1, :2]) < 0.5
    assert flight.p[:, 2].max() < 8.0


@pytest.mark.long(after=1)
@pytest.mark.parametrize("start", [flights.in_front_transition, flights.offboard_forward, flights.landing_from_cruise])
def test_from_forward_flight_it_comes_to_rest_and_lands_without_a_fall(start):
    flight = start(FORWARD)
    lose(flight, LAND)
    flight.land()
    assert not flight.failsafes
    assert np.linalg.norm(flight.v[-1]) < 1.0
    assert flight.p[flight.flown_forward, 2].min() > flights.HIGH - 6.0


@pytest.mark.long
def test_a_mission_in_forward_flight_that_loses_its_link_comes_home():
    flight = flights.on_forward_mission(FORWARD)
    lose(flight, RETURN, "companion")
    flight.land()
    assert np.linalg.norm(flight.p[-1, :2]) < 1.0
    assert not flight.failsafes


# In the same second


@pytest.mark.long(after=1)
@pytest.mark.parametrize("start", [flights.on_hovered_mission, flights.in_cruise, flights.offboard_forward])
@pytest.mark.parametrize("later", [0.0, 0.6])
@pytest.mark.parametrize("first", ["ground", "companion"])
def test_of_two_losses_in_a_second_the_graver_is_flown_whichever_comes_first(start, later, first):
    settings = FORWARD._replace(link_action=int(RETURN), companion_action=int(LAND))
    flight = start(settings)
    flight.lose(first)
    flight.fly(later)
    flight.lose(*TEXTS)
    flight.fly(AFTER + 1.0)
    assert flight.autopilot.mode is Mode.LAND
    assert len(flight.alarms) == 2
    assert flight.modes[-1] is Mode.LAND
    assert [flight.modes.count(mode) for mode in (Mode.RTL, Mode.LAND)] in ([0, 1], [1, 1])  # nothing flips


def test_two_links_lost_at_once_are_two_lines_with_the_same_action():
    flight = flights.in_cruise(FORWARD._replace(link_action=int(HOLD), companion_action=int(RETURN)))
    flight.lose(*TEXTS)
    flight.fly(AFTER)
    assert flight.alarms == ["No ground station for 2 s: returning", "No companion for 2 s: returning"]


# Back again


def test_a_link_that_comes_back_while_it_returns_does_not_stop_the_return():
    flight = flights.in_cruise(FORWARD)
    lose(flight, RETURN)
    flight.find("ground")
    flight.fly(0.5)
    assert flight.texts.count("Ground station is back") == 1
    assert flight.autopilot.mode is Mode.RTL
    lose(flight, RETURN)
    assert flight.alarms == ["No ground station for 2 s: returning", "No ground station for 2 s: return continues"]
    flight.land()
    assert np.linalg.norm(flight.p[-1, :2]) < 1.0
    assert flight.modes[-2:] == [Mode.RTL, Mode.HOLD]  # landed


def test_a_request_after_an_alarm_is_carried_out():
    flight = flights.in_cruise(FORWARD)
    lose(flight, RETURN)
    assert flight.autopilot.guided.hold().accepted
    flight.fly(5.0)
    assert flight.autopilot.mode is Mode.HOLD
    assert len(flight.alarms) == 1


# A program that flies it


def test_a_companion_without_heartbeats_is_lost_though_its_set_points_arrive():
    flight = flights.offboard_hovering(FORWARD)
    lose(flight, HOLD, "companion")
    flight.fly(2.0)
    assert flight.modes[-2:] == [Mode.OFFBOARD, Mode.HOLD]
    assert np.linalg.norm(flight.v[-1]) < 0.6


def test_by_default_its_set_points_are_flown_as_long_as_they_arrive():
    flight = flights.offboard_hovering(FORWARD)
    lose(flight, SafetyAction.NONE, "companion")
    assert flight.alarms == ["No companion for 2 s: going on"]
    assert flight.autopilot.mode is Mode.OFFBOARD
    flight.stream = flights.nothing
    flight.fly(0.8)
    assert flight.texts[-1] == "Set-points stopped: holding"


def test_the_set_points_of_a_dead_companion_are_missed_first():
    flight = flights.offboard_forward(FORWARD._replace(setpoint_action=3, companion_action=int(HOLD)))
    flight.stream = flights.nothing
    flight.lose("companion")
    flight.fly(AFTER)
    assert flight.texts[-2:] == ["Set-points stopped: returning", "No companion for 2 s: return continues"]
    assert flight.modes[-2:] == [Mode.OFFBOARD, Mode.RTL]
