"""The autopilot's chooser: chains of legs in the wind as it is, settings and tuning as they are."""

import math

import pytest

from protocol.dialect.vocabulary import DecisionReason, LegMode
from protocol.frames import LocalFrame
from protocol.ranges import LEGS_AHEAD
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.guidance.view import VehicleView
from sitl.model.airframe_files import load
from sitl.prediction.chooser import Chooser, LegEnd
from sitl.prediction.corners import Leg
from sitl.simulation.simulation import Simulation
from sitl.simulation.tuning import Tuning
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings
from tests.support.flights.tunings import BY_REPORT

NOMINAL = load("nominal").parameters
MIN_LEG = 15.1  # [m]
VIEW = VehicleView(0.0, (0.0, 0.0, 20.0), (0.0, 0.0, 0.0), 0.0, 0.0, False, 1.0)
# Uphill into a strong wind that carries the upright vehicle: the hover is cheap but slow.
UPHILL = Leg(60.0, 57.0, -6.8, -1.7, 3.0)


def test_a_leg_the_hover_wins_is_flown_when_only_the_wing_keeps_the_deadline():
    course = UPHILL.turn
    c, s = math.cos(course), math.sin(course)
    wind = (c * UPHILL.tail_wind - s * UPHILL.cross_wind, s * UPHILL.tail_wind + c * UPHILL.cross_wind, 0.0)
    end = (c * UPHILL.distance, s * UPHILL.distance, 20.0 + UPHILL.climb)

    def choose(leg_time):
        chooser = Chooser(NOMINAL, BY_REPORT, can_fly_forward=True)
        asked = Settings(min_leg=MIN_LEG, leg_time=leg_time)
        return chooser.choose(VIEW._replace(wind=wind), VIEW.p, [LegEnd(end)], asked, 18.6)[0]

    free = choose(0.0)
    assert (free.leg_mode, free.reason) == (LegMode.HOVER, DecisionReason.ENERGY)
    assert free.forward.time < free.hover.time
    pressed = choose(0.5 * (free.forward.time + free.hover.time))
    assert (pressed.leg_mode, pressed.reason) == (LegMode.FORWARD, DecisionReason.DEADLINE)
    assert pressed.forward.energy > pressed.hover.energy
    assert choose(1.1 * free.hover.time).leg_mode is LegMode.HOVER


def test_a_chain_is_decided_as_far_as_the_vehicle_looks_and_its_first_leg_is_reported():
    chooser = Chooser(NOMINAL, Tuning(), can_fly_forward=True)
    ends = [LegEnd((100.0 * i, 0.0, 20.0), seq=i) for i in range(1, 12)]
    made = chooser.choose(VIEW, VIEW.p, ends, Settings(), 15.0)
    assert len(made) == LEGS_AHEAD
    assert all(decision.leg_mode is LegMode.FORWARD for decision in made)
    assert chooser.made() == [(1, made[0])]
    assert chooser.made() == []


def test_legs_are_seen_in_the_wind_along_and_across_them():
    chooser = Chooser(NOMINAL, Tuning(), can_fly_forward=True)
    ends = [LegEnd((0.0, 60.0, 25.0)), LegEnd((0.0, 20.0, 22.0))]  # to the west, and back
    out, back = chooser.choose(VIEW._replace(wind=(1.0, 2.0, 0.0)), VIEW.p, ends, Settings(), 15.0)
    assert out.leg == pytest.approx(Leg(60.0, 5.0, 2.0, -1.0, 0.5 * math.pi, 20.0))
    assert back.leg == pytest.approx(Leg(40.0, -3.0, -2.0, 1.0, -math.pi, 22.0))


def test_in_forward_flight_the_turn_to_a_leg_is_from_the_course_over_the_ground():
    chooser = Chooser(NOMINAL, Tuning(), can_fly_forward=True)
    flying = VIEW._replace(v=(0.0, 14.0, 0.0), heading=1.2, forward=True)  # to the west, the nose in the wind
    start, ends = (0.0, 12.0, 20.0), [LegEnd((80.0, 12.0, 20.0))]
    made = chooser.choose(flying, start, ends, Settings(), 15.0)[0]
    assert made.leg.turn == pytest.approx(-0.5 * math.pi)
    hovering = chooser.choose(VIEW, start, ends, Settings(), 15.0)[0]
    assert made.forward.time < hovering.forward.time


def test_what_is_told_of_a_leg_does_not_turn_with_the_noise_of_the_wind():
    """About the report's laws' break-even after a quarter turn, in gusts."""
    winds, settings = [(0.0, 0.15 * (i % 3 - 1), 0.0) for i in range(9)], Settings(min_leg=10.0)
    turned = False
    for length in (29.5 + 0.05 * i for i in range(12)):
        ends = [LegEnd((0.0, length, 20.0))]
        one = Chooser(NOMINAL, BY_REPORT, can_fly_forward=True)
        told = [one.predict(wind, 0.0, VIEW.p, ends, settings)[0] for wind in winds]
        turned |= len({made.forward.energy < made.hover.energy for made in told}) > 1
        assert len({made.leg_mode for made in told}) == 1
    assert turned  # without what was told before, one of them would


def test_changed_parameters_change_the_prediction_in_flight():
    tuning, slower = BY_REPORT, BY_REPORT._replace(v_enter=5.0, kpd=0.6)
    configuration = Configuration(Settings(leg_mode=LegMode.HOVER), tuning, WorldSettings())
    aircraft = Aircraft(Simulation(NOMINAL), World(LocalFrame(HOME), ARENAS["open"]), configuration)
    chooser = aircraft.autopilot.chooser

    def energy():
        return chooser.energy(VIEW, VIEW.p, (40.0, 0.0, 20.0), configuration.settings, flying=False)

    assert chooser.airframe == NOMINAL
    before = energy()
    aircraft.configure(configuration._replace(tuning=slower))
    assert aircraft.vehicle.tuning == chooser.tuning == slower
    after = energy()
    aircraft.configure(configuration)
    assert after > 1.02 * before
    assert energy() == before


def test_the_prediction_is_of_the_airframe_that_the_laws_are_designed_for():
    real = NOMINAL._replace(m=1.2 * NOMINAL.m)
    configuration = Configuration(Settings(), Tuning(), WorldSettings())
    vehicle = Simulation(real, design_model=NOMINAL)
    aircraft = Aircraft(vehicle, World(LocalFrame(HOME), ARENAS["open"]), configuration)
    assert aircraft.autopilot.chooser.airframe == NOMINAL
