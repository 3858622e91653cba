"""Whether it stands: on the ground, in the air, between the two, and with a model that is wrong."""

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.reference import along, hover_at, leg
from sitl.estimation.contact import (
    LEAVES,
    LIES,
    LOW,
    LOW_NOSE,
    LOW_TOUCHES,
    MAX_CONTACT_SPEED,
    MAX_LYING_HEIGHT,
    TOUCHES,
    smoothed,
    stands,
    support_of,
)
from sitl.lab.studies.campaign import UNCERTAIN, perturbed
from sitl.model.aerodynamics import wrench
from sitl.model.ground import LEVEL_GROUND, is_touching
from sitl.model.quaternions import from_euler, hover, rotate_inverse
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, scaled
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from tests.support.flights.sensed_flights import MOCAP, NOMINAL, SENSORS, UP, on_ground, watched

STILL, OFF = Vector(0.0, 0.0, 0.0), Actuators(0.0, 0.0, 0.0, 0.0)
G = NOMINAL.g
HIGH = 30.0


def ten_per_cent_off(sign):
    return perturbed(NOMINAL, {name: 1.0 + 0.1 * sign * (1 if k % 2 else -1) for k, name in enumerate(UNCERTAIN)})


def felt(v, q, actuators, a):
    """Specific force that the accelerometer of an airframe feels off the ground [m/s2]."""
    F, _ = wrench(rotate_inverse(q, v), STILL, actuators, a)
    return scaled(F, 1.0 / a.m)


def test_what_stands_is_held_up_by_its_weight():
    q = from_euler(0.1, -1.4, 0.5)
    force = rotate_inverse(q, Vector(0.0, 0.0, G))
    assert support_of(force, STILL, STILL, q, OFF, NOMINAL) == pytest.approx(G)


@pytest.mark.parametrize("v", [STILL, Vector(14.0, 1.0, -0.5), Vector(3.0, -2.0, -6.0)])
def test_what_flies_is_held_up_by_air_and_propellers_alone(v):
    q, actuators = from_euler(0.1, -0.3, 0.2), Actuators(560.0, 540.0, 0.1, 0.05)
    assert support_of(felt(v, q, actuators, NOMINAL), v, STILL, q, actuators, NOMINAL) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_pull_of_two_g_is_no_ground_to_a_model_that_is_ten_per_cent_off(sign):
    true, v = ten_per_cent_off(sign), Vector(18.0, 0.0, 0.0)
    actuators = Actuators(500.0, 500.0, 0.0, 0.0)
    pitches = [from_euler(0.0, -pitch, 0.0) for pitch in np.linspace(0.0, 0.5, 101)]
    pulled = min(pitches, key=lambda q: abs(felt(v, q, actuators, true).z - 2.0 * G))
    force = felt(v, pulled, actuators, true)
    assert force.z == pytest.approx(2.0 * G, rel=0.05)
    support = support_of(force, v, STILL, pulled, actuators, NOMINAL)
    assert abs(support) > 0.02 * G  # the model is wrong
    assert not stands(support, 0.0, 1.0, False, HIGH, HIGH, STILL, G)


def test_it_takes_more_to_touch_than_to_stay_and_nothing_fast_stands():
    between = 0.5 * (TOUCHES + LEAVES) * G
    assert stands(between, 0.0, 1.0, True, HIGH, HIGH, STILL, G)
    assert not stands(between, 0.0, 1.0, False, HIGH, HIGH, STILL, G)
    assert stands(G, 0.0, 1.0, False, HIGH, HIGH, STILL, G)
    assert not stands(G, 0.0, 1.0, True, HIGH, HIGH, Vector(MAX_CONTACT_SPEED + 0.1, 0.0, 0.0), G)


def test_what_the_air_may_push_is_no_ground():
    push = 0.5 * G
    assert stands(push, 0.0, 1.0, False, HIGH, HIGH, STILL, G)
    assert not stands(push, 0.1 * G, 1.0, False, HIGH, HIGH, STILL, G)
    assert stands(G, 0.1 * G, 1.0, False, HIGH, HIGH, STILL, G)


def test_a_wing_that_the_wind_carries_does_not_lie_on_the_ground():
    carried = 0.5 * (TOUCHES + LIES) * G
    assert stands(carried, 0.0, 1.0, False, HIGH, HIGH, STILL, G)
    assert not stands(carried, 0.0, LOW_NOSE - 0.01, False, HIGH, HIGH, STILL, G)
    assert stands(G, 0.0, 0.0, False, HIGH, 0.0, STILL, G)
    assert not stands(carried, 0.0, LOW_NOSE - 0.01, True, HIGH, HIGH, STILL, G)
    assert stands(G, 0.3 * G, 0.0, False, HIGH, 0.0, STILL, G)


def test_where_the_ground_is_expected_less_of_the_weight_is_enough():
    light = 0.5 * (LOW_TOUCHES + TOUCHES) * G
    assert stands(light, 0.0, 1.0, False, LOW - 0.01, 0.0, STILL, G)
    assert not stands(light, 0.0, 1.0, False, LOW + 0.01, 0.0, STILL, G)
    assert not stands(light, 0.1 * G, 1.0, False, LOW - 0.01, 0.0, STILL, G)


@pytest.mark.parametrize("stood", [False, True])
def test_nothing_lies_in_the_air_however_a_gust_carries_it(stood):
    for carried in (G, 3.0 * G):
        assert stands(carried, 0.0, 0.0, stood, HIGH, MAX_LYING_HEIGHT - 0.01, STILL, G)
        assert not stands(carried, 0.0, 0.0, stood, HIGH, MAX_LYING_HEIGHT + 0.01, STILL, G)
        assert stands(carried, 0.0, 1.0, stood, HIGH, HIGH, STILL, G)  # upright, it lands on any hill


def test_the_support_follows_within_its_time():
    support = 0.0
    for _ in range(10):
        support = smoothed(G, support, 0.01)
    assert support == pytest.approx(G * (1.0 - np.exp(-1.0)), rel=1e-3)


def told(simulation):
    return simulation.estimate.on_ground


def near_the_ground(simulation):
    return simulation.truth.body.position.z < 0.2


def touches(simulation):
    return is_touching(simulation.truth, LEVEL_GROUND, simulation.airframe)


@pytest.mark.parametrize(("navigation", "seed"), [(SENSORS, 1), (MOCAP, 2)])
def test_from_the_ground_into_the_air_and_back(navigation, seed):
    made = on_ground(navigation, seed)
    stood = watched(made, 1.0, told)
    assert stood.all()
    made.armed = made.flying = True
    made.reference = hover_at((0.0, 0.0, 3.0), 0.0)
    rising = watched(made, 10.0, told, touches)
    left = int(np.argmin(rising[:, 1]))
    assert left > 0 or not rising[0, 1]
    assert not rising[left + 5 :, 0].any()  # half a second after it left the ground
    made.landing = True
    made.reference = hover_at((0.0, 0.0, -1.0), 0.0, 0.5)
    down = watched(made, 16.0, told, near_the_ground)  # a bounce may fall between two looks
    met = int(np.argmax(down[:, 1]))
    assert met > 5
    assert not down[: met - 2, 0].any()
    assert down[-10:, 0].all()
    assert made.law is Law.LANDED
    assert made.crash is None


@pytest.mark.parametrize("sign", [0, 1, -1])
def test_it_never_stands_between_hover_and_cruise_even_with_a_wrong_model(sign):
    airframe = ten_per_cent_off(sign) if sign else NOMINAL
    start = Start(up=UP, airborne=True)
    made = Simulation(airframe, seed=2, start=start, design_model=NOMINAL, navigation=SENSORS)
    made.set_wind((2.0, 1.0, 0.0), 0.5)
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    made.reference = hold = hover_at((0.0, 0.0, UP), 0.0)
    assert not watched(made, 5.0, told).any()
    made.reference = along(hold, leg((0.0, 0.0, UP), (400.0, 0.0, UP), 15.0), 0.0)
    flown = watched(made, 20.0, told, lambda s: np.hypot(*s.truth.body.velocity[:2]))
    assert flown[:, 1].max() > 10.0
    assert not flown[:, 0].any()


def test_upright_on_the_ground_it_stands_however_long():
    made = on_ground(MOCAP, 5, heading=1.0)
    assert made.truth.body.attitude == hover(1.0)
    assert watched(made, 6.0, told).all()
