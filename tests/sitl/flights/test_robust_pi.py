"""The robust PI law in flight: chosen, it takes over the hover; what it loses the hybrid controller brings back."""

import math

import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.reference import along, hover_at, leg
from sitl.model.airframe_files import load
from sitl.model.quaternions import multiply
from sitl.model.vectors import Vector
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import ROBUST_PI, Tuning
from tests.support.flights.estimates import rotation
from tests.support.paths import DATA

QUICK = load(str(DATA / "darko-quick-servos.toml")).parameters
HEIGHT = 40.0
CHOSEN = Tuning(controller=ROBUST_PI)


def hovering(tuning=CHOSEN, heading=0.0):
    simulation = Simulation(QUICK, start=Start(up=HEIGHT, heading=heading, airborne=True), tuning=tuning)
    simulation.reference = hover_at((0.0, 0.0, HEIGHT), heading)
    simulation.begin_flight(Law.HOVER_LINEAR)
    return simulation


def off(simulation, place):
    return math.dist(simulation.truth.body.position, place)


def test_it_takes_over_the_hover_and_gives_it_back_without_a_start():
    simulation = hovering(Tuning())
    simulation.step(1.0)
    assert simulation.law is Law.HOVER_LINEAR
    simulation.retune(CHOSEN)
    simulation.step(4.0)
    assert simulation.law is Law.ROBUST_PI
    assert off(simulation, (0.0, 0.0, HEIGHT)) < 0.01
    simulation.retune(Tuning())
    simulation.step(4.0)
    assert simulation.law is Law.HOVER_LINEAR
    assert off(simulation, (0.0, 0.0, HEIGHT)) < 0.05


@pytest.mark.parametrize("heading", [0.0, 3.0])
def test_it_goes_to_a_point_by_hovering_whatever_its_heading_even_along_a_leg(heading):
    simulation, target = hovering(), (18.0, -3.0, HEIGHT + 1.0)
    path = leg((0.0, 0.0, HEIGHT), target, 15.0)
    simulation.step(1.0)
    simulation.reference = along(simulation.reference, path, heading)
    simulation.step(30.0)
    assert {jump.target for jump in simulation.jumps} == {Law.ROBUST_PI}
    assert simulation.law is Law.ROBUST_PI
    assert off(simulation, target) < 0.05


def test_a_wind_leans_it_and_moves_it_by_less_than_a_third_of_a_metre():
    simulation, most = hovering(), 0.0
    for k in range(120):
        simulation.set_wind((-min(0.1 * k, 5.0), 0.0, 0.0))
        simulation.step(0.2)
        most = max(most, off(simulation, (0.0, 0.0, HEIGHT)))
    assert 0.02 < most < 0.33
    assert off(simulation, (0.0, 0.0, HEIGHT)) < 0.03
    assert {jump.target for jump in simulation.jumps} == {Law.ROBUST_PI}


def test_knocked_out_of_its_region_it_is_brought_back_and_flies_on():
    simulation = hovering()
    simulation.step(2.0)
    body = simulation.truth.body
    turned = multiply(body.attitude, rotation((0.0, 1.8, 0.0)))
    simulation.place(body._replace(attitude=turned, velocity=Vector(2.0, 0.0, 0.0)))
    simulation.step(15.0)
    assert [jump.name for jump in simulation.jumps][1] == "lose_robust_pi"
    assert simulation.law is Law.ROBUST_PI
    assert off(simulation, (0.0, 0.0, HEIGHT)) < 0.1
