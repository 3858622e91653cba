"""INDI in the air: hover, cruise and stop without a jump; turned, mirrored, on sensors, chosen and left in flight."""

import math

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law, Regime
from sitl.control.reference import along, hover_at, leg
from sitl.model.airframe_files import load
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.situation import regime
from sitl.simulation.start import Start
from sitl.simulation.tuning import CONTROLLERS, Tuning
from tests.support.flights.falls import falling
from tests.support.flights.tunings import BY_REPORT

COLLAGE = load("collage").parameters
INDI = Tuning(controller=CONTROLLERS["indi"])
HIGH, FAR = 60.0, 250.0
HOME = (0.0, 0.0, HIGH)


def flying(heading=0.0, *, airframe=COLLAGE, tuning=INDI, navigation=Navigation.TRUTH, seed=1):
    made = Simulation(
        airframe, seed=seed, start=Start(up=HIGH, heading=heading, airborne=True), design_model=COLLAGE,
        tuning=tuning, navigation=navigation,
    )  # fmt: skip
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    made.reference = hover_at(HOME, heading)
    return made


def sent(simulation, azimuth, airspeed=15.0):
    """Sent along a leg, to hover at its end."""
    end = (FAR * math.cos(azimuth), FAR * math.sin(azimuth), HIGH)
    simulation.reference = along(hover_at(end, azimuth), leg(HOME, end, airspeed), azimuth)
    return end


def hopped(azimuth, heading=0.0, seconds=36.0, **how):
    simulation = flying(heading, **how)
    end = sent(simulation, azimuth)
    return simulation, simulation.record(seconds), np.array(end)


@pytest.mark.parametrize("azimuth", [0.0, 2.0, -1.0])
def test_one_law_hovers_cruises_and_stops(azimuth):
    simulation, flown, end = hopped(azimuth)
    assert [jump.name for jump in simulation.jumps] == ["choose_indi"]
    speed = np.linalg.norm(flown.velocity[:, :2], axis=1)
    assert speed.max() == pytest.approx(15.0, abs=0.5)
    assert np.linalg.norm(flown.position[-1] - end) < 0.3
    assert np.abs(flown.position[:, 2] - HIGH).max() < 6.0
    beyond = flown.position[:, :2] @ np.array((math.cos(azimuth), math.sin(azimuth))) - FAR
    assert beyond.max() < 1.0


def test_it_turns_smoothly_from_hover_to_cruise_to_hover():
    """Even where the wing stalls, and the incidence that carries it folds over by 20 deg."""
    _, flown, _ = hopped(0.0)
    assert np.linalg.norm(flown.rates, axis=1).max() < 3.0
    assert np.abs(np.diff(flown.actuators[:, :2], axis=0)).max() < 0.8 * COLLAGE.omega_rate * 0.02


def test_no_direction_is_different_and_left_is_the_mirror_of_right():
    _, north, _ = hopped(0.0)
    _, turned, _ = hopped(2.0, heading=2.0)
    c, s = math.cos(2.0), math.sin(2.0)
    back = turned.position @ np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    assert np.abs(back - north.position).max() < 0.5
    _, left, _ = hopped(1.0)
    _, right, _ = hopped(-1.0)
    assert np.abs(left.position - right.position * (1.0, -1.0, 1.0)).max() < 0.5


def test_a_seed_is_one_flight():
    one, other = (flying(navigation=Navigation.SENSORS, seed=7) for _ in range(2))
    for simulation in (one, other):
        simulation.set_wind((3.0, 1.0, 0.0), 1.0)
        sent(simulation, 0.5)
        simulation.step(6.0)
    assert one.flight == other.flight


def test_on_sensors_in_wind_and_gusts_with_another_airframe_than_it_knows_it_arrives():
    heavier = COLLAGE._replace(m=1.08 * COLLAGE.m, C_l=0.92 * COLLAGE.C_l, k_f=0.95 * COLLAGE.k_f)
    simulation = flying(airframe=heavier, navigation=Navigation.SENSORS, seed=3)
    simulation.set_wind((2.0, 3.0, 0.0), 1.0)
    end = sent(simulation, 0.0)
    simulation.step(45.0)
    assert math.dist(simulation.truth.body.position, end) < 4.0
    assert simulation.truth.body.position.z > HIGH - 8.0


def test_the_regime_is_that_of_the_flight():
    simulation, seen = flying(), []
    simulation.step(1.0)
    seen.append(regime(simulation))
    sent(simulation, 0.0)
    for _ in range(70):
        simulation.step(0.5)
        seen.append(regime(simulation))
    order = [Regime.UPRIGHT, Regime.FRONT_TRANSITION, Regime.FORWARD, Regime.BACK_TRANSITION, Regime.UPRIGHT]
    assert [r for r, before in zip(seen, [None, *seen], strict=False) if r is not before] == order


@pytest.mark.parametrize("seconds", [2.0, 12.0, 17.5])
def test_the_schools_change_in_hover_in_cruise_and_while_braking(seconds):
    """There and back, wherever it is on its way; both bring it home."""
    simulation = flying()
    end = sent(simulation, 0.0)
    simulation.step(seconds)
    assert simulation.law is Law.INDI
    simulation.retune(BY_REPORT)
    simulation.step(1.0)
    assert simulation.law is not Law.INDI
    simulation.retune(INDI)
    simulation.step(40.0)
    assert simulation.law is Law.INDI
    assert math.dist(simulation.truth.body.position, end) < 0.5
    assert simulation.truth.body.position.z > HIGH - 10.0


@pytest.mark.parametrize("seed", range(6))
def test_a_fall_from_any_attitude_ends_upright(seed):
    simulation = falling(COLLAGE, seed, (0.0, 0.0, -10.0), tuning=INDI)
    flown = simulation.record(25.0)
    assert math.dist(simulation.truth.body.position, flown.reference[-1]) < 1.0
    assert {jump.target for jump in simulation.jumps} == {Law.INDI}
