"""Whether it stands: on the ground, in the air, between the two, and with a model that is wrong."""

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.reference import along, hover_at, leg
from sitl.estimation.contact import (
    LEAVE_SHARE,
    LIES,
    LOW,
    LOW_NOSE,
    LOW_TOUCH_SHARE,
    MAX_CONTACT_SPEED,
    MAX_FALLEN_HEIGHT,
    MAX_LYING_HEIGHT,
    SLOW_TOUCH,
    SMOOTHED,
    SUDDEN,
    SURE,
    TOUCH_SHARE,
    Posture,
    Support,
    smoothed,
    stands,
    support_of,
)
from sitl.lab.studies.wrong_models import UNCERTAIN, perturbed
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


UPRIGHT = Posture(nose_up=1.0, height=HIGH, least_height=HIGH, velocity=STILL, stood=False, lands=False)


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
    assert not stands(Support(support, 0.0, 0.0), G, UPRIGHT)


def test_it_takes_more_to_touch_than_to_stay_and_nothing_fast_stands():
    between = 0.5 * (TOUCH_SHARE + LEAVE_SHARE) * G
    assert stands(Support(between, 0.0, 0.0), G, UPRIGHT._replace(stood=True))
    assert not stands(Support(between, 0.0, 0.0), G, UPRIGHT)
    assert stands(Support(G, 0.0, 0.0), G, UPRIGHT)
    assert not stands(
        Support(G, 0.0, 0.0), G, UPRIGHT._replace(stood=True, velocity=Vector(MAX_CONTACT_SPEED + 0.1, 0.0, 0.0))
    )


def test_what_the_air_may_push_is_no_ground():
    push = 0.5 * G
    assert stands(Support(push, 0.0, 0.0), G, UPRIGHT)
    assert not stands(Support(push, 0.0, 0.1 * G), G, UPRIGHT)
    assert stands(Support(G, 0.0, 0.1 * G), G, UPRIGHT)


def test_a_wing_that_the_wind_carries_does_not_lie_on_the_ground():
    carried = 0.5 * (TOUCH_SHARE + LIES) * G
    assert stands(Support(carried, 0.0, 0.0), G, UPRIGHT)
    assert not stands(Support(carried, 0.0, 0.0), G, UPRIGHT._replace(nose_up=LOW_NOSE - 0.01))
    assert stands(Support(G, 0.0, 0.0), G, UPRIGHT._replace(nose_up=0.0, least_height=0.0))
    assert not stands(Support(carried, 0.0, 0.0), G, UPRIGHT._replace(nose_up=LOW_NOSE - 0.01, stood=True))
    assert stands(Support(G, 0.0, 0.3 * G), G, UPRIGHT._replace(nose_up=0.0, least_height=0.0))


def test_where_the_ground_is_expected_less_of_the_weight_is_enough():
    light = 0.5 * (LOW_TOUCH_SHARE + TOUCH_SHARE) * G
    assert stands(Support(light, 0.0, 0.0), G, UPRIGHT._replace(height=LOW - 0.01, least_height=0.0))
    assert not stands(Support(light, 0.0, 0.0), G, UPRIGHT._replace(height=LOW + 0.01, least_height=0.0))
    assert not stands(Support(light, 0.0, 0.1 * G), G, UPRIGHT._replace(height=LOW - 0.01, least_height=0.0))


def test_less_is_enough_that_comes_suddenly_to_a_vehicle_that_wants_to_land():
    light, landing, doubt = (LEAVE_SHARE + 0.01) * G, UPRIGHT._replace(lands=True), 0.03 * G
    soon = Support(light, light - (SUDDEN + 0.001) * G, 0.0)
    assert stands(soon, G, landing)
    assert not stands(Support(light, light - (SUDDEN - 0.001) * G, 0.0), G, landing)  # it came slowly
    more = light + SURE * doubt
    assert stands(Support(more, more - (SUDDEN + 0.001) * G - doubt, doubt), G, landing)
    assert not stands(Support(more, more - (SUDDEN - 0.001) * G - doubt, doubt), G, landing)  # as a gust does
    assert not stands(soon._replace(doubt=0.1 * G), G, landing)  # the air may have pushed
    assert not stands(soon, G, UPRIGHT)
    assert not stands(soon, G, landing._replace(velocity=Vector(0.0, 0.0, -SLOW_TOUCH - 0.01)))


@pytest.mark.parametrize("stood", [False, True])
def test_nothing_lies_in_the_air_however_a_gust_carries_it(stood):
    for carried in (G, 3.0 * G):
        assert stands(
            Support(carried, 0.0, 0.0),
            G,
            UPRIGHT._replace(nose_up=0.0, least_height=MAX_LYING_HEIGHT - 0.01, stood=stood),
        )
        assert not stands(
            Support(carried, 0.0, 0.0),
            G,
            UPRIGHT._replace(nose_up=0.0, least_height=MAX_LYING_HEIGHT + 0.01, stood=stood),
        )
        assert stands(Support(carried, 0.0, 0.0), G, UPRIGHT)  # upright, it lands on any hill
        fallen = UPRIGHT._replace(nose_up=0.0, lands=True, stood=stood)
        assert stands(Support(carried, 0.0, 0.0), G, fallen._replace(least_height=MAX_FALLEN_HEIGHT - 0.01))
        assert not stands(Support(carried, 0.0, 0.0), G, fallen._replace(least_height=MAX_FALLEN_HEIGHT + 0.01))


def test_the_support_follows_within_its_time():
    support = 0.0
    for _ in range(10):
        support = smoothed(G, support, 0.01, SMOOTHED)
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
