"""MAV_CMD_DO_VTOL_TRANSITION as a long running command: its progress, every end it can come to, its cancelling."""

import itertools
import math

import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Way
from protocol.modes import Mode
from sitl.autopilot.guidance import View
from sitl.autopilot.progress import TIME_LIMIT, Transition, is_reached
from sitl.control.reference import along, hover_at, leg
from sitl.craft import is_forward
from tests.support.station import Sky
from tests.support.wing_flight import Flight, waypoint

TRANSITION = mavlink.MAV_CMD_DO_VTOL_TRANSITION
WING, HOVER = mavlink.MAV_VTOL_STATE_FW, mavlink.MAV_VTOL_STATE_MC
ACCEPTED, FAILED, CANCELLED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_FAILED, mavlink.MAV_RESULT_CANCELLED
REJECTED, IN_PROGRESS = mavlink.MAV_RESULT_TEMPORARILY_REJECTED, mavlink.MAV_RESULT_IN_PROGRESS
HIGH = 40.0
HERE = hover_at((0.0, 0.0, HIGH), 0.0, 3.0)
LEG = along(HERE, leg(HERE.position, (500.0, 0.0, HIGH), 15.0), 0.0)


def view(law=Law.HOVER_LINEAR, time=0.0, tilt=0.0, speed=0.0, forward=None):
    forward = is_forward(law) if forward is None else forward
    return View(
        time, HERE.position, (speed, 0.0, 0.0), 0.0, tilt, landed=False, energy_left=1.0, forward=forward, law=law
    )


# The measure


@pytest.mark.parametrize(
    ("way", "law", "reference", "reached"),
    [
        (Way.FORWARD, Law.HOVER_LINEAR, LEG, False),
        (Way.FORWARD, Law.TO_FORWARD, LEG, False),
        (Way.FORWARD, Law.FORWARD_LINE_OF_SIGHT, LEG, True),
        (Way.FORWARD, Law.FORWARD_LINEAR, LEG, True),
        (Way.FORWARD, Law.TO_HOVER, HERE, False),
        (Way.HOVER, Law.FORWARD_LINEAR, HERE, False),
        (Way.HOVER, Law.TO_HOVER, HERE, False),
        (Way.HOVER, Law.HOVER_ZERO_MOMENT, HERE, True),
        (Way.HOVER, Law.ALIGN, LEG, False),  # upright, but about to tip over
        (Way.HOVER, Law.FAILSAFE, HERE, False),
    ],
)
def test_a_way_of_flying_is_reached_under_its_own_laws(way, law, reference, reached):
    assert is_reached(way, view(law), reference) is reached


def test_progress_grows_with_tilt_and_airspeed_and_never_falls():
    transition, told = Transition(Way.FORWARD, view()), []
    for tilt, speed in ((0.0, 0.0), (0.3, 2.0), (0.1, 1.0), (1.0, 7.0), (1.5, 20.0)):
        transition.look(view(Law.TO_FORWARD, tilt=tilt, speed=speed), LEG)
        told.append(transition.percent)
    assert told[0] == 0
    assert told == sorted(told)
    assert told[1] == told[2] < told[3] < told[4] == 99
    assert transition.end is None


@pytest.mark.parametrize(
    ("way", "seen", "reference", "result", "word"),
    [
        (Way.FORWARD, view(Law.FORWARD_LINEAR), LEG, ACCEPTED, ""),
        (Way.FORWARD, view(Law.FAILSAFE), LEG, FAILED, "fall"),
        (Way.HOVER, view(Law.FAILSAFE), HERE, FAILED, "fall"),
        (Way.FORWARD, view(Law.ALIGN, time=TIME_LIMIT + 1.0), LEG, FAILED, "not done in 60 s"),
        (Way.FORWARD, view(), HERE, ACCEPTED, "hovered"),  # a mission's leg that is better hovered
        (Way.HOVER, view(Law.HOVER_LINEAR), HERE, ACCEPTED, ""),
    ],
)
def test_each_end_has_its_result_and_stays(way, seen, reference, result, word):
    transition = Transition(way, view(Law.FORWARD_LINEAR if way is Way.HOVER else Law.HOVER_LINEAR))
    transition.look(seen, reference)
    assert transition.end.result == result
    assert word in transition.end.text
    transition.cancel()
    assert transition.end.result == result


# In the air


def test_the_autopilot_holds_after_a_transition_that_failed():
    flight = Flight()
    flight.autopilot.transition(Way.FORWARD)
    flight.fly(1.0)
    flight.autopilot.under_way.fail("the test says so")
    flight.fly(6.0)
    assert not is_forward(flight.vehicle.law)
    assert any("the test says so" in text for text in flight.said)
    assert flight.autopilot.mode is Mode.HOLD


def test_a_mission_goes_on_as_before_when_its_transition_is_cancelled():
    flight = Flight()
    flight.autopilot.arm()
    flight.autopilot.load_mission((waypoint(20.0, 0.0, 25.0), waypoint(20.0, 200.0, 25.0)))
    flight.autopilot.start_mission()
    flight.fly(1.0)
    assert flight.autopilot.transition(Way.HOVER).result == ACCEPTED
    assert flight.autopilot.transition(Way.FORWARD).accepted
    flight.autopilot.cancel_transition()
    flight.fly_until(lambda: flight.autopilot.mission.current == 1, 30.0)
    flight.fly(10.0)
    assert flight.autopilot.mode is Mode.MISSION
    assert not flight.winged.any()


def test_a_mission_says_when_the_item_under_way_is_hovered_all_the_same():
    flight = Flight()
    flight.autopilot.arm()
    flight.autopilot.load_mission((waypoint(5.0, 0.0, 25.0), waypoint(5.0, 5.0, 25.0)))
    flight.autopilot.start_mission()
    flight.fly(0.2)
    flight.autopilot.transition(Way.FORWARD)
    flight.fly(0.2)
    assert flight.autopilot.under_way is None
    assert "This item is hovered" in "".join(flight.said)


# On the wire


@pytest.fixture
def sky(tmp_path):
    return Sky(tmp_path, up=HIGH)


@pytest.fixture
def station(sky):
    station = sky.station()
    sky.advance(0.5)
    return station


def acks(station, command=TRANSITION):
    return [m for m in station.heard if m.get_type() == "COMMAND_ACK" and m.command == command]


def final(station):
    ends = [m.result for m in acks(station) if m.result != IN_PROGRESS]
    assert len(ends) <= 1
    return ends[0] if ends else None


def cancel(command=TRANSITION):
    return mavlink.MAVLink_command_cancel_message(1, 1, command)


def test_a_transition_is_told_to_its_end_there_and_back(sky, station):
    assert station.command(TRANSITION, WING) == IN_PROGRESS
    times = [sky.now]
    while final(station) is None:
        count = len(acks(station))
        sky.advance(0.02)
        times += [sky.now] * (len(acks(station)) - count)
        assert sky.now < 30.0
    assert final(station) == ACCEPTED
    assert max(b - a for a, b in itertools.pairwise(times)) <= 0.5
    assert sky.craft.vehicle.law is Law.FORWARD_LINE_OF_SIGHT
    told = [m.progress for m in acks(station)[:-1]]
    assert told == sorted(told)
    assert told[0] < 20
    assert 60 < told[-1] < 100
    station.heard.clear()
    assert station.command(TRANSITION, WING) == ACCEPTED  # it flies on the wing
    station.heard.clear()
    assert station.command(TRANSITION, HOVER) == IN_PROGRESS
    sky.advance_until(lambda: final(station) is not None, 30.0)
    assert final(station) == ACCEPTED
    assert not sky.craft.view().forward
    station.heard.clear()
    assert station.command(TRANSITION, HOVER) == ACCEPTED


@pytest.mark.parametrize("after", [0.2, 2.0])
def test_a_cancelled_transition_to_the_wing_holds_upright(sky, station, after):
    station.command(TRANSITION, WING)
    sky.advance(after)
    station.send(cancel())
    assert final(station) == CANCELLED
    assert "cancelled" in station.texts()
    sky.advance(12.0)
    assert final(station) == CANCELLED
    assert not is_forward(sky.craft.vehicle.law)
    assert station.flight_mode is Mode.HOLD


def test_a_cancelled_transition_to_the_hover_holds_upright(sky, station):
    station.command(TRANSITION, WING)
    sky.advance_until(lambda: final(station) is not None, 30.0)
    station.heard.clear()
    station.command(TRANSITION, HOVER)
    sky.advance(0.5)
    station.send(cancel())
    assert final(station) == CANCELLED
    sky.advance(15.0)
    assert not is_forward(sky.craft.vehicle.law)


def test_nobody_else_can_cancel_it_or_begin_another(sky, station):
    station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    other = sky.station(245, "other")
    station.command(TRANSITION, WING)
    other.send(cancel())
    assert final(station) is None
    assert station.command(TRANSITION, HOVER) == REJECTED
    assert "one is under way" in station.texts()
    assert sky.autopilot.under_way.way is Way.FORWARD


@pytest.mark.parametrize(
    ("order", "word"),
    [
        (lambda s: s.command(mavlink.MAV_CMD_NAV_LAND), "LAND came between"),
        (lambda s: s.mode(Mode.HOLD), "HOLD came between"),
        (lambda s: s.command(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH), "RTL came between"),
        (lambda s: s.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196), "the flight is over"),
    ],
)
def test_another_order_is_obeyed_at_once_and_ends_the_transition(sky, station, order, word):
    station.command(TRANSITION, WING)
    sky.advance(0.2)
    assert order(station) == ACCEPTED
    assert final(station) == FAILED
    assert word in station.texts()
    sky.advance(1.0)
    assert final(station) == FAILED


def test_without_room_to_circle_it_stays_upright_and_says_so(sky, station):
    sky.craft.bind(sky.craft.bindings.replaced({"GF_MAX_HOR_DIST": 60.0}))
    assert station.command(TRANSITION, WING) == REJECTED
    assert "no room to circle" in station.texts()
    assert sky.autopilot.under_way is None


def test_a_repeated_request_is_told_how_far_it_is(sky, station):
    station.command(TRANSITION, WING)
    sky.advance(2.0)
    station.heard.clear()
    station.send(mavlink.MAVLink_command_long_message(1, 1, TRANSITION, 1, WING, *[math.nan] * 6))
    assert [m.result for m in acks(station)] == [IN_PROGRESS]
    assert acks(station)[0].progress > 0


def test_a_failsafe_ends_the_transition_in_words(sky, station):
    station.command(TRANSITION, WING)
    sky.advance(0.2)
    sky.craft.bind(sky.craft.bindings.replaced({"SIM_BAT_ENERGY": 100.0}))
    sky.advance_until(lambda: final(station) is not None, 5.0)
    assert final(station) == FAILED
    assert "came between" in station.texts()
