"""Legs that are flown on through a corner: predicted beside flown, on the truth."""

import math

import pytest

from protocol.dialect.vocabulary import LegMode
from sitl.autopilot.settings import Settings
from sitl.control.reference import leg as straight
from sitl.defaults import AIRFRAME, BRISK, GENTLE
from sitl.guidance.leg_speeds import MAX_CORNER_SHARE
from sitl.lab.studies.seeded_flights import STUDY_WORLD, has_finished_mission, waypoint
from sitl.model.airframe_files import load
from sitl.model.vectors import Vector
from sitl.prediction.corners import Leg, flying_on
from sitl.prediction.mode_choice import choose_modes
from sitl.prediction.passing import first_passing, is_passed, passed_on
from sitl.prediction.predictor import Abilities, predict_forward
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS, Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings

HEIGHT, RUN_UP, RUN_OUT = 45.0, 150.0, 100.0  # of the legs; before the corner, and straight on after the leg [m]
ABLE = Abilities(load(AIRFRAME).parameters, Tuning(), can_fly_forward=True, hover_speed=3.0, airspeed=15.0)


def flown(turn, distance, *, stop, pace):
    """A leg after a corner, forward in calm: the decision on it, its time [s] and its energy [J]."""
    vehicle = Simulation(load(AIRFRAME).parameters, start=Start(up=HEIGHT, airborne=True), tuning=Tuning(pace=pace))
    settings = Settings(leg_mode=LegMode.FORWARD, airspeed=15.0, min_leg=0.0)
    configuration = Configuration(settings, vehicle.tuning, WorldSettings(battery=1e9))
    aircraft = Aircraft(vehicle, STUDY_WORLD, configuration, airborne=True)
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    ends = [distance] if stop else [distance, distance + RUN_OUT]
    aircraft.autopilot.missions.load(
        [waypoint(RUN_UP, 0.0, HEIGHT), *(waypoint(RUN_UP + end * c, end * s, HEIGHT) for end in ends)]
    )
    aircraft.autopilot.missions.start()
    made = []
    while not has_finished_mission(aircraft):
        aircraft.advance(AUTOPILOT_PERIODS)
        made += [(one, vehicle.time, vehicle.energy) for _, one in aircraft.autopilot.decisions()]
    made.append((None, vehicle.time, vehicle.energy))
    (decision, time, energy), (_, end, used) = made[1:3]
    return decision, end - time, used - energy


@pytest.mark.parametrize(
    ("turn", "distance", "stop", "pace", "limit"),
    [
        (120, 40.0, False, GENTLE, 0.05),  # with a circle, as its end lies within that of the turn
        (90, 40.0, True, BRISK, 0.12),
        (30, 100.0, False, GENTLE, 0.03),
        (60, 40.0, False, BRISK, 0.03),
        (90, 100.0, False, GENTLE, 0.03),
        (150, 100.0, True, GENTLE, 0.08),
        (170, 40.0, True, GENTLE, 0.1),
        (170, 40.0, False, GENTLE, 0.11),
        (170, 100.0, False, BRISK, 0.2),
    ],
)
def test_a_leg_after_a_corner_takes_as_long_as_flown(turn, distance, stop, pace, limit):
    """By the whole vehicle from the decision on; the prediction is fitted to none of them."""
    decision, time, energy = flown(turn, distance, stop=stop, pace=pace)
    assert decision.leg_mode is LegMode.FORWARD
    assert decision.forward.time == pytest.approx(time, rel=limit)
    assert decision.forward.energy == pytest.approx(energy, rel=limit + 0.15)  # cruising alone is 12 % off


def test_a_sharper_turn_takes_longer_and_more():
    taken = [predict_forward(Leg(150.0, 0.0, turn=turn), ABLE, begin=False, end=False) for turn in (0.0, 0.8, 1.5)]
    assert taken[0].time + 0.3 < taken[1].time < taken[2].time
    assert taken[0].energy + 50.0 < taken[1].energy < taken[2].energy


def test_either_side_takes_the_same_in_calm_but_not_in_a_wind():
    def time(turn, cross_wind):
        leg = Leg(100.0, 0.0, cross_wind=cross_wind, turn=turn)
        return predict_forward(leg, ABLE, begin=False, end=False).time

    assert time(2.2, 0.0) == pytest.approx(time(-2.2, 0.0), rel=1e-6)
    assert time(2.2, 3.0) == pytest.approx(time(-2.2, -3.0), rel=1e-6)
    assert time(-2.2, 3.0) > time(2.2, 3.0) + 1.0  # the turn against the wind is blown farther


def test_a_leg_slows_down_before_a_slow_one():
    long, short = Leg(150.0, 0.0), Leg(30.0, 0.0, turn=1.5)
    slow = flying_on([long, short], 15.0)
    assert slow[0].airspeed == 15.0
    assert slow[0].exit == slow[1].entry == slow[1].airspeed < 12.0
    assert [one.airspeed for one in flying_on([long, short], 15.0, is_long=True)] == [15.0, 15.0]
    made = choose_modes([long, short], ABLE, 0.0, [LegMode.FORWARD] * 2)
    fast = predict_forward(long, ABLE, end=False, row=slow[0]._replace(exit=math.inf))
    assert fast.time + 0.3 < made[0].forward.time < fast.time + 2.0


def test_a_turn_begins_before_the_corner_and_ends_the_leg_before_it():
    first, second = flying_on([Leg(150.0, 0.0), Leg(150.0, 0.0, turn=1.0)], 15.0)
    assert first.lead == 0.0  # it begins at rest
    assert 10.0 < first.early == second.lead < MAX_CORNER_SHARE * 150.0
    assert second.early == 0.0
    assert flying_on([Leg(150.0, 0.0, turn=1.0)], 15.0, lead=7.0)[0].lead == pytest.approx(7.0)  # where it is now


def test_a_waypoint_within_the_circle_of_the_turn_is_met_after_a_circle_away_from_it():
    path, calm, north = straight((0.0, 0.0, 0.0), (0.0, 20.0, 0.0), 15.0, stop=False), Vector(0.0, 0.0, 0.0), 15.0
    start, v = Vector(0.0, 0.0, 0.0), Vector(north, 0.0, 0.0)
    circling = passed_on(first_passing(path, 0.0), start, v, path, calm, 5.0)
    assert circling.is_circling
    assert circling.path.radius < 0.0  # to the right, as it lies to the left
    assert not is_passed(circling, start, 5.0)
    facing = passed_on(circling, Vector(-30.0, 20.0, 0.0), v, path, calm, 5.0)
    assert not facing.is_circling
    assert facing.path.start == Vector(-30.0, 20.0, 0.0)
    assert is_passed(facing, Vector(0.0, 20.0, 0.0), 5.0)


def test_a_waypoint_that_was_missed_is_circled_for_but_not_for_ever():
    path, calm = straight((0.0, 0.0, 0.0), (200.0, 0.0, 0.0), 15.0, stop=False), Vector(0.0, 0.0, 0.0)
    beside, v = Vector(201.0, 30.0, 0.0), Vector(15.0, 0.0, 0.0)
    passing = passed_on(first_passing(path, 0.0), Vector(0.0, 0.0, 0.0), v, path, calm, 5.0)
    assert not passing.is_circling
    for _ in range(3):
        assert not is_passed(passing, beside, 5.0)
        passing = passed_on(passing, beside, v, path, calm, 5.0)
        assert passing.is_circling
        passing = passed_on(passing, Vector(150.0, 0.0, 0.0), v, path, calm, 5.0)
    assert is_passed(passing, beside, 5.0)
