"""Links lost in flight: each way of flying with each action, and what else happens in the same second."""

import numpy as np
import pytest

from protocol.modes import Mode
from sitl.autopilot.alarm import DOING, GOING_ON, Action
from tests.support import failsafe_flights as flights
from tests.support.failsafe_flights import MODES, ON_THE_WING, TIMEOUT, UPRIGHT, WAYS

HOLD, RETURN, LAND = Action.HOLD, Action.RETURN, Action.LAND
ACTIONS = (HOLD, RETURN, LAND)
AFTER = TIMEOUT + 0.1  # until a loss is noticed [s]
ALONE = {"ground": "No ground station for 2 s", "companion": "No companion for 2 s"}


def lose(flight, action, link="ground"):
    """Lose a link and fly until that is noticed."""
    field = "link_action" if link == "ground" else "companion_action"
    flight.autopilot.apply(flight.autopilot.settings._replace(**{field: int(action)}))
    flight.lose(link)
    flight.fly(AFTER)


# Each way of flying, each action


@pytest.mark.parametrize("action", ACTIONS, ids=lambda action: action.name)
@pytest.mark.parametrize("begun", WAYS, ids=lambda begun: begun.start.__name__)
def test_a_lost_link_starts_what_is_set_unless_something_graver_is_under_way(begun, action):
    link = list(ALONE)[int(action) % 2]
    flight = begun.start(ON_THE_WING)
    before = flight.modes[-1]
    lose(flight, action, link)
    flight.fly(1.5)
    graver = action <= begun.under_way
    said = GOING_ON[begun.under_way] if graver else DOING[action]
    assert flight.alarms == [f"{ALONE[link]}: {said}"]
    assert flight.autopilot.mode is (before if graver else MODES[action])
    changes = flight.modes[flight.modes.index(before) + 1 :]
    assert changes == [] if graver or before is MODES[action] else [MODES[action]]  # nothing flips
    assert not flight.failsafes
    assert flight.p[-1, 2] > 0.5


def test_going_on_is_going_on():
    flight = flights.on_a_winged_mission(ON_THE_WING)
    lose(flight, Action.NONE)
    assert flight.alarms == ["No ground station for 2 s: going on"]
    assert flight.autopilot.mode is Mode.MISSION


# To the end


def test_a_take_off_that_loses_its_link_comes_home():
    flight = flights.taking_off(UPRIGHT._replace(return_altitude=6.0))
    lose(flight, RETURN)
    flight.land(60.0)
    assert np.linalg.norm(flight.p[-1, :2]) < 0.5
    assert 5.0 < flight.p[:, 2].max() < 9.0  # no higher than it has to for the return


def test_a_vehicle_that_tips_over_when_it_loses_its_link_comes_home():
    flight = flights.tipping_over(ON_THE_WING)
    lose(flight, RETURN)
    flight.land(60.0)
    assert flight.p[:, 0].max() < 35.0
    assert np.linalg.norm(flight.p[-1, :2]) < 0.5


def test_a_take_off_that_loses_its_link_lands_below():
    flight = flights.taking_off(ON_THE_WING)
    lose(flight, LAND)
    flight.land(30.0)
    assert np.linalg.norm(flight.p[-1, :2]) < 0.5
    assert flight.p[:, 2].max() < 8.0


@pytest.mark.parametrize("start", [flights.tipping_over, flights.offboard_on_the_wing, flights.landing_from_the_wing])
def test_from_the_wing_it_stands_up_and_lands_without_a_fall(start):
    flight = start(ON_THE_WING)
    lose(flight, LAND)
    flight.land()
    assert not flight.failsafes
    assert np.linalg.norm(flight.v[-1]) < 1.0
    assert flight.p[flight.winged, 2].min() > flights.HIGH - 6.0


def test_a_mission_on_the_wing_that_loses_its_link_comes_home():
    flight = flights.on_a_winged_mission(ON_THE_WING)
    lose(flight, RETURN, "companion")
    flight.land()
    assert np.linalg.norm(flight.p[-1, :2]) < 1.0
    assert not flight.failsafes


# In the same second


@pytest.mark.parametrize("start", [flights.on_a_hovered_mission, flights.on_the_wing, flights.offboard_on_the_wing])
@pytest.mark.parametrize("later", [0.0, 0.6])
@pytest.mark.parametrize("first", ["ground", "companion"])
def test_of_two_losses_in_a_second_the_graver_is_flown_whichever_comes_first(start, later, first):
    settings = ON_THE_WING._replace(link_action=int(RETURN), companion_action=int(LAND))
    flight = start(settings)
    flight.lose(first)
    flight.fly(later)
    flight.lose(*ALONE)
    flight.fly(AFTER + 1.0)
    assert flight.autopilot.mode is Mode.LAND
    assert len(flight.alarms) == 2
    assert flight.modes[-1] is Mode.LAND
    assert [flight.modes.count(mode) for mode in (Mode.RTL, Mode.LAND)] in ([0, 1], [1, 1])  # nothing flips


def test_two_links_lost_at_once_are_two_lines_that_say_the_same():
    flight = flights.on_the_wing(ON_THE_WING._replace(link_action=int(HOLD), companion_action=int(RETURN)))
    flight.lose(*ALONE)
    flight.fly(AFTER)
    assert flight.alarms == ["No ground station for 2 s: returning", "No companion for 2 s: returning"]


# Back again


def test_a_link_that_comes_back_while_it_returns_does_not_stop_the_return():
    flight = flights.on_the_wing(ON_THE_WING)
    lose(flight, RETURN)
    flight.find("ground")
    flight.fly(0.5)
    assert flight.said.count("Ground station is back") == 1
    assert flight.autopilot.mode is Mode.RTL
    lose(flight, RETURN)
    assert flight.alarms == ["No ground station for 2 s: returning", "No ground station for 2 s: the return goes on"]
    flight.land()
    assert np.linalg.norm(flight.p[-1, :2]) < 1.0
    assert flight.modes[-2:] == [Mode.RTL, Mode.HOLD]  # landed


def test_what_the_pilot_asks_for_after_an_alarm_is_done():
    flight = flights.on_the_wing(ON_THE_WING)
    lose(flight, RETURN)
    assert flight.autopilot.hold().accepted
    flight.fly(5.0)
    assert flight.autopilot.mode is Mode.HOLD
    assert len(flight.alarms) == 1


# A program that flies it


def test_a_companion_whose_heartbeat_is_gone_is_lost_though_its_set_points_come():
    flight = flights.offboard_upright(ON_THE_WING)
    lose(flight, HOLD, "companion")
    flight.fly(2.0)
    assert flight.modes[-2:] == [Mode.OFFBOARD, Mode.HOLD]
    assert np.linalg.norm(flight.v[-1]) < 0.6


def test_by_default_its_set_points_are_flown_as_long_as_they_come():
    flight = flights.offboard_upright(ON_THE_WING)
    lose(flight, Action.NONE, "companion")
    assert flight.alarms == ["No companion for 2 s: going on"]
    assert flight.autopilot.mode is Mode.OFFBOARD
    flight.stream = flights.nothing
    flight.fly(0.8)
    assert flight.said[-1] == "Set-points stopped: holding"


def test_a_companion_that_dies_is_missed_by_its_set_points_first():
    flight = flights.offboard_on_the_wing(ON_THE_WING._replace(setpoint_action=3, companion_action=int(HOLD)))
    flight.stream = flights.nothing
    flight.lose("companion")
    flight.fly(AFTER)
    assert flight.said[-2:] == ["Set-points stopped: returning", "No companion for 2 s: the return goes on"]
    assert flight.modes[-2:] == [Mode.OFFBOARD, Mode.RTL]
