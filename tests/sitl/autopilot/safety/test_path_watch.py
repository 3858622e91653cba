"""The watch of the path: who leaves it, or flies faster than can be, stops; who turns onto it, does not."""

import math

import pytest

from sitl.autopilot.answers import SafetyAction
from sitl.autopilot.path_watch import PERSISTS, PathWatch
from sitl.control.reference import along, circle, hover_at, leg
from sitl.guidance.view import VehicleView

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
