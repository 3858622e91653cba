"""The watch of the path: who leaves it, or flies faster than can be, stops; who turns onto it, does not."""

import math
from types import SimpleNamespace

import pytest

from protocol.names import Mode
from sitl import Law, Regime
from sitl.autopilot.answers import SafetyAction
from sitl.autopilot.manual import Sticks
from sitl.autopilot.path_watch import HOVER_STANDS_AFTER, PERSISTS, ArenaWatch, PathWatch, way_to_stop
from sitl.autopilot.settings import Settings
from sitl.control.reference import along, circle, hover_at, leg
from sitl.guidance.setpoints import HeadingSetpoint
from sitl.guidance.view import VehicleView
from tests.support.flights.enclosed import CAGE, PILLAR, EnclosedFlight

HEIGHT = 30.0
HOVERING = hover_at((0.0, 0.0, HEIGHT), 0.0)
LEG = along(HOVERING, leg((0.0, 0.0, HEIGHT), (300.0, 0.0, HEIGHT), 15.0), 0.0)
ROOM = 30.0
STEP = 0.1  # [s]


def view(time, p, v, **seen):
    return VehicleView(
        time, (*p, HEIGHT), (*v, 0.0), heading=0.0, tilt=1.2, landed=False, battery_remaining=1.0, forward=True
    )._replace(**seen)


def flown(track, reference=LEG, *, room=ROOM, watch=None, **seen):
    """Alarms along a track of places, one every STEP, with the time and place of each."""
    watch, alarms, before = watch or PathWatch(), [], track[0]
    for n, p in enumerate(track):
        v = ((p[0] - before[0]) / STEP, (p[1] - before[1]) / STEP)
        alarms += [(alarm, n * STEP, p) for alarm in watch.check(view(n * STEP, p, v, **seen), reference, room)]
        before = p
    return alarms


def straight(start, course, speed, seconds):
    x, y = start
    c, s = math.cos(course), math.sin(course)
    return [(x + speed * k * STEP * c, y + speed * k * STEP * s) for k in range(round(seconds / STEP))]


def test_a_flight_along_its_leg_raises_nothing():
    assert flown(straight((0.0, 3.0), 0.0, 15.0, 20.0)) == []


def test_a_flight_past_the_end_of_its_leg_stops():
    ((alarm, time, p),) = flown(straight((0.0, 0.0), 0.0, 15.0, 60.0))
    assert (alarm.action, alarm.always) == (SafetyAction.HOLD, True)
    assert alarm.reason == f"{p[0] - 300.0:.0f} m off the path"
    assert 330.0 < p[0] < 330.0 + 15.0 * (PERSISTS + 0.3)
    assert time > PERSISTS


def test_a_vehicle_that_brakes_behind_the_end_is_left_to_come_back_to_it():
    braking = [(250.0 + 20.0 * t - 1.0 * t * t, 0.0) for t in (k * STEP for k in range(100))]  # at rest 50 m behind it
    stands = [braking[-1]] * 50
    assert flown(braking + stands, law=Law.TO_HOVER) == []
    ((alarm, _, _),) = flown(braking + stands, law=Law.FORWARD_LINE_OF_SIGHT)
    assert alarm.action is SafetyAction.HOLD


def test_a_leg_too_short_to_stop_on_may_be_overflown_by_what_stopping_takes():
    short = along(HOVERING, leg((0.0, 0.0, HEIGHT), (30.0, 0.0, HEIGHT), 15.0), 0.0)
    braking = [
        (15.0 * t - 0.9 * t * t, 0.0) for t in (k * STEP for k in range(83))
    ]  # 62 m, at rest 32 m behind the end
    stands = [braking[-1]] * 50
    assert flown(braking + stands, short, stopping_distance=62.0) == []
    ((_, _, p),) = flown(straight((0.0, 0.0), 0.0, 15.0, 30.0), short, stopping_distance=62.0)
    assert 30.0 + 63.0 + ROOM < p[0] < 30.0 + 63.0 + ROOM + 15.0 * (PERSISTS + 0.3)
    goes_on = along(HOVERING, leg((0.0, 0.0, HEIGHT), (30.0, 0.0, HEIGHT), 15.0, stop=False), 0.0)
    ((_, _, p),) = flown(straight((0.0, 0.0), 0.0, 15.0, 30.0), goes_on, stopping_distance=62.0)
    assert p[0] < 30.0 + ROOM + 15.0 * (PERSISTS + 0.3)


def test_a_flight_that_drifts_off_its_leg_stops():
    track = straight((0.0, 0.0), 0.0, 15.0, 5.0) + straight((75.0, 0.0), 0.5, 15.0, 30.0)
    ((_, _, p),) = flown(track)
    assert ROOM < p[1] < ROOM + 20.0


def test_a_vehicle_that_turns_round_first_may_go_away_for_two_radii():
    radius, turn = 37.0, []
    for k in range(round(math.pi * 37.0 / 15.0 / STEP)):
        angle = 15.0 * k * STEP / radius
        turn.append((-radius * math.sin(angle), radius * (1.0 - math.cos(angle))))
    back = straight(turn[-1], 0.0, 15.0, 5.0)
    assert flown(turn + back) == []
    ((_, _, p),) = flown(straight((0.0, 0.0), math.pi, 15.0, 30.0))
    assert -260.0 < p[0] < -180.0


def test_one_that_comes_from_far_off_may_be_far_off():
    assert flown(straight((0.0, 200.0), -math.pi / 4.0, 15.0, 15.0)) == []


def test_a_ground_speed_that_wind_and_airspeed_do_not_make_stops_it():
    ((alarm, _, _),) = flown(straight((0.0, 0.0), 0.0, 28.0, 8.0))
    assert alarm.reason == "Ground speed 28 m/s, wanted airspeed 15 m/s"
    assert flown(straight((0.0, 0.0), 0.0, 28.0, 8.0), wind=(8.0, 0.0, 0.0)) == []


def test_a_circle_is_left_outwards():
    round_it = along(HOVERING, circle((0.0, 0.0, HEIGHT), 40.0, 15.0), 0.0)
    on = [(40.0 * math.cos(15.0 / 40.0 * k * STEP), 40.0 * math.sin(15.0 / 40.0 * k * STEP)) for k in range(170)]
    assert flown(on, round_it) == []
    away = straight(on[-1], 0.0, 15.0, 20.0)
    assert len(flown(on + away, round_it)) == 1


@pytest.mark.parametrize("seen", [{"forward": False}])
def test_upright_nothing_is_watched(seen):
    assert flown(straight((0.0, 0.0), 1.5, 15.0, 20.0), **seen) == []
    assert flown(straight((0.0, 0.0), 1.5, 15.0, 20.0), HOVERING) == []


def test_no_room_set_means_any():
    assert flown(straight((0.0, 0.0), 1.5, 15.0, 20.0), room=0.0) == []


def test_another_path_begins_anew_and_the_alarm_is_raised_once():
    watch = PathWatch()
    assert len(flown(straight((0.0, 0.0), 0.0, 15.0, 60.0), watch=watch)) == 1
    assert watch.has_left
    watch.check(view(100.0, (0.0, 0.0), (0.0, 0.0), forward=False), HOVERING, ROOM)
    assert not watch.has_left


# The net's failsafe, stage by stage and in flight; requests that leave are refused.


HOLD, LAND, CUT, NONE = SafetyAction.HOLD, SafetyAction.LAND, SafetyAction.TERMINATE, SafetyAction.NONE


def arena_view(time, north, speed=0.0, **changed):
    still = VehicleView(
        time=time, p=(north, 0.0, 3.0), v=(speed, 0.0, 0.0), heading=0.0, tilt=0.0, landed=False, battery_remaining=1.0
    )
    return still._replace(**changed)


def actions(watch, seen, *, landing=False, **settings):
    alarms = watch.check(seen, CAGE, Settings(**settings), landing=landing)
    return [alarm.action for alarm in alarms]


def test_it_holds_where_the_way_to_a_stop_leaves_too_little_room():
    """At 3 m/s it stands after 1.8 m: 0.5 m of room is reached from 2.7 m on."""
    assert actions(ArenaWatch(), arena_view(1.0, 2.6, 3.0)) == []
    assert actions(ArenaWatch(), arena_view(1.0, 2.8, 3.0)) == [HOLD]
    assert actions(ArenaWatch(), arena_view(1.0, 2.8, 3.0), net_action=1) == [NONE]
    assert actions(ArenaWatch(), arena_view(1.0, 2.8, -3.0)) == []


def test_a_tail_wind_and_forward_flight_make_the_way_longer():
    assert way_to_stop(arena_view(1.0, 0.0, 2.0))[-1][0] == pytest.approx(2.0 * HOVER_STANDS_AFTER)
    assert way_to_stop(arena_view(1.0, 0.0, 2.0, wind=(4.0, 0.0, 0.0)))[-1][0] > 2.0 * HOVER_STANDS_AFTER + 1.0
    assert way_to_stop(arena_view(1.0, 0.0, 10.0, forward=True, stopping_distance=25.0))[-1][0] > 25.0


def test_the_chain_is_hold_then_land_then_cut():
    watch = ArenaWatch()
    assert actions(watch, arena_view(1.0, 4.6)) == [HOLD]
    assert actions(watch, arena_view(3.0, 4.6)) == []
    assert actions(watch, arena_view(4.5, 4.6)) == [LAND]
    assert actions(watch, arena_view(4.6, 4.75, 0.2)) == [CUT]
    assert actions(watch, arena_view(4.7, 4.8, 0.2), landing=True) == []  # once


@pytest.mark.parametrize(("action", "expected"), [(2, [HOLD]), (3, [HOLD, LAND]), (4, [HOLD, LAND, CUT])])
def test_the_parameter_says_how_far_the_chain_goes(action, expected):
    watch, seen = ArenaWatch(), []
    for time, north, speed in ((1.0, 4.6, 0.0), (4.5, 4.6, 0.0), (4.6, 4.75, 0.2)):
        seen += actions(watch, arena_view(time, north, speed), net_action=action)
    assert list(dict.fromkeys(seen)) == expected


def test_a_landing_is_left_alone_but_for_the_last_stage():
    watch = ArenaWatch()
    assert actions(watch, arena_view(1.0, 4.6), landing=True) == []
    assert actions(watch, arena_view(1.1, 4.75, 0.2), landing=True) == [CUT]


def test_away_from_the_net_nothing_is_cut_and_it_begins_anew():
    watch = ArenaWatch()
    assert actions(watch, arena_view(1.0, 4.75, -0.2)) == [HOLD]
    assert actions(watch, arena_view(2.0, 3.0)) == []
    assert actions(watch, arena_view(6.0, 3.0)) == []
    assert not watch.near
    assert actions(watch, arena_view(7.0, 4.6)) == [HOLD]


def test_an_obstacle_counts_as_the_net_does():
    arena = CAGE._replace(obstacles=(PILLAR,))
    alarm = ArenaWatch().check(arena_view(1.0, -1.9, 2.0), arena, Settings(), landing=False)[0]
    assert (alarm.action, alarm.reason) == (HOLD, "1.6 m from pillar")


def test_before_an_obstacle_it_holds_and_no_more():
    """It may stand under the vehicle."""
    arena, watch, seen = CAGE._replace(obstacles=(PILLAR,)), ArenaWatch(), []
    for time, north in ((1.0, -0.7), (6.0, -0.7), (9.0, -0.5)):
        seen += watch.check(arena_view(time, north, 0.2), arena, Settings(), landing=False)
    assert {alarm.action for alarm in seen} == {HOLD}


# In flight


def test_points_outside_are_refused_with_the_reason():
    flight = EnclosedFlight()
    answer = flight.autopilot.guided.go_to((3.9, 0.0, 2.0))
    assert answer.result != 0
    assert answer.text == "Go-to denied: 3.9 m north is outside the arena 'cage' (limit 3.8 m)"
    assert flight.autopilot.guided.go_to((0.0, 0.0, 6.0)).result != 0
    assert flight.autopilot.offboard.set_position((0.0, -4.0, 2.0)) is not None
    assert flight.autopilot.guided.take_off(50.0).result != 0


def test_from_corner_to_corner_in_calm_it_keeps_its_margin():
    flight = EnclosedFlight(at=(-3.8, -3.8, 1.5))
    assert flight.autopilot.guided.go_to((3.8, 3.8, 5.8)).result == 0
    flight.fly(12.0)
    assert math.dist(flight.place, (3.8, 3.8, 5.8)) < 0.1
    assert flight.room > 0.9  # 1.2 m are asked for
    assert not any("holding" in text for text in flight.texts)


def test_sticks_held_to_the_net_end_inside():
    flight = EnclosedFlight()
    flight.autopilot.manual.take_sticks(Sticks(1.0, 1.0, 1.0))
    assert flight.autopilot.manual.start().result == 0
    flight.fly(10.0, each=lambda: flight.autopilot.manual.take_sticks(Sticks(1.0, 1.0, 1.0)))
    assert flight.vehicle.crash is None
    assert flight.room > 0.7


def test_a_streamed_velocity_is_refused_at_the_margin():
    flight, said = EnclosedFlight(), []

    def stream():
        said.append(flight.autopilot.offboard.set_velocity((2.0, 0.0, 0.0), HeadingSetpoint()))

    stream()
    assert flight.autopilot.offboard.start().result == 0
    flight.fly(10.0, each=stream)
    assert any(said)
    assert flight.vehicle.crash is None
    assert flight.room > 0.5


def test_blown_to_the_net_it_holds_lands_or_is_cut_before_it_touches():
    """A wind that the report's laws cannot stand against: first it holds, and at the last the motors are cut."""
    flight = EnclosedFlight(DRK_CONTROLLER=0, SIM_WIND_SPD=16.0, SIM_WIND_DIR=180.0)
    flight.fly(20.0, until=lambda: bool(flight.autopilot.terminated))
    assert any("m from the net: holding" in text for text in flight.texts)
    assert flight.autopilot.terminated.endswith("m from the net")
    assert any(text.startswith("Motors cut: 0.") for text in flight.texts)


def test_a_vehicle_that_stays_too_near_lands():
    """A room that only the middle has: told to go elsewhere it holds where it is, and after a while lands there."""
    flight = EnclosedFlight(DRK_NET_ROOM=4.5, DRK_NET_TIME=2.0)
    assert flight.autopilot.guided.go_to((2.0, 0.0, 2.0)).result == 0
    flight.fly(30.0, until=lambda: flight.vehicle.law.regime is Regime.GROUND)
    words = [text.split(": ")[-1] for text in flight.texts]
    assert words.index("holding") < words.index("landing")
    assert flight.vehicle.law.regime is Regime.GROUND
    assert flight.vehicle.crash is None


def test_touching_has_its_own_words():
    flight = EnclosedFlight(DRK_CONTROLLER=0, DRK_NET_ACT=0, SIM_WIND_SPD=16.0, SIM_WIND_DIR=180.0)
    flight.fly(20.0)
    flight.aircraft.advance(20)
    texts = flight.texts + [notice.text for notice in flight.autopilot.notices()]
    assert any(text.startswith("Crashed into the net of cage at ") for text in texts)
    assert flight.autopilot.mode is Mode.HOLD
    assert "into the net of cage" in flight.autopilot.arming.failed_checks()[0]


def test_a_failsafes_hold_is_flown_farther_inside_than_a_request():
    flight = EnclosedFlight()
    flight.vehicle.place(flight.vehicle.truth.body._replace(position=flight.place._replace(x=4.6)))
    flight.fly(0.1)
    assert flight.autopilot.reference.position.x == pytest.approx(5.0 - 1.2 - 1.2, abs=0.1)


@pytest.mark.parametrize(
    ("rooms", "reason"),
    [
        (((0.8, "net"), (0.4, "net")), "0.8 m from net"),
        (((0.8, "net"), (0.4, "pillar")), "Would stop 0.4 m from pillar"),
    ],
)
def test_an_alarm_joins_a_distance_to_the_thing_it_was_measured_to(rooms, reason):
    now, ahead = rooms
    arena = SimpleNamespace(room=lambda p: now if p[0] == 0.0 else ahead)
    (alarm,) = ArenaWatch().check(arena_view(100.0, 0.0, 2.0), arena, Settings(), landing=False)
    assert alarm.reason == reason
