"""The linear forward law on the full plant: what it comes back from, and what it holds."""

import math

import numpy as np
import pytest

from sitl.model.airframe_files import load
from tests.support.flights.linear_forward_flight import NOMINAL, disturb, fly, moved, on_leg

SIZES = {"offset": 3.0, "speed": 1.0, "attitude": math.radians(25.0), "rate": 1.0}


def draws(airspeed, count, seed=1):
    """Flights from random states about the leg."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield fly(disturb(on_leg(airspeed), rng, **SIZES), airspeed, duration=8.0)


@pytest.mark.long
@pytest.mark.parametrize("speed", [1.0, 3.0, 5.5, 8.0, 10.0, 12.0, 15.0, 18.0, 22.0, 25.0])
def test_it_comes_back_to_the_leg_and_v_falls(speed):
    """From 3 m, 1 m/s, 25 deg and 1 rad/s in random directions."""
    for flight in draws(speed, 40):
        assert flight.converged()
        V = flight.v_hover[flight.time >= 1.0]
        assert (np.diff(V) < 1e-9)[V[1:] > 1e-4].all()


@pytest.mark.long
@pytest.mark.parametrize(("airspeed", "climb"), [(8.0, -20.0), (8.0, 45.0), (12.0, -10.0), (12.0, 30.0), (20.0, 45.0)])
def test_it_holds_climbing_and_descending_legs(airspeed, climb):
    rng, climb = np.random.default_rng(2), math.radians(climb)
    for _ in range(10):
        plant = disturb(on_leg(airspeed, climb=climb), rng, **SIZES)
        assert fly(plant, airspeed, climb=climb, duration=12.0).converged()


@pytest.mark.parametrize("airspeed", [8.0, 15.0, 22.0])
@pytest.mark.parametrize("wind", [(0.0, 4.0, 0.0), (-4.0, 0.0, 0.0), (2.8, -2.8, 0.0), (0.0, 0.0, 1.0)])
def test_a_known_wind_that_sets_in_leaves_no_error(airspeed, wind):
    flight = fly(on_leg(airspeed), airspeed, wind=wind, duration=10.0)
    assert flight.offset.max() < 0.8
    assert flight.offset[-1] < 0.02


def test_a_wind_nobody_knows_of_leaves_half_a_metre():
    for airspeed in (8.0, 12.0, 20.0):
        for wind in ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)):
            assert fly(on_leg(airspeed), airspeed, wind=wind, known_wind=(0, 0, 0), duration=12.0).offset[-1] < 0.6


@pytest.mark.parametrize("airspeed", [5.5, 8.0, 12.0, 20.0])
def test_far_from_the_leg_it_approaches_at_an_angle(airspeed):
    for away in ({"west": 30.0}, {"up": 30.0}):
        flight = fly(moved(on_leg(airspeed), **away), airspeed, duration=25.0)
        assert flight.converged()
        assert flight.offset.max() < 30.2  # the elevons push the wrong way first
        assert np.diff(flight.offset[flight.time > 1.0]).max() < 1e-3
        assert np.degrees(flight.attitude.max()) < 45.0


def test_it_flies_from_hover_to_cruise_and_back_as_the_airspeed_is_ramped():
    out = fly(on_leg(0.0), 0.0, ramp=1.5, duration=12.0)
    assert out.offset.max() < 0.3
    back = fly(on_leg(18.0), 18.0, ramp=-0.8, duration=22.5)
    assert back.offset.max() < 0.3
    assert back.attitude.max() < math.radians(5.0)


@pytest.mark.parametrize("start", [0.0, 5.0, 8.0, 25.0])
def test_any_airspeed_may_be_asked_for_at_once_on_a_straight_leg(start):
    for wanted in range(0, 26, 5):
        flight = fly(on_leg(start), wanted, duration=20.0)
        assert flight.converged()
        assert flight.offset.max() < 6.0


@pytest.mark.parametrize("airspeed", [5.5, 8.0, 12.0, 20.0])
def test_a_leg_may_turn(airspeed):
    """A circle at 15 deg/s, flown as the tangent beside the vehicle: it runs wide, and steadily so."""
    flight = fly(on_leg(airspeed), airspeed, radius=airspeed / math.radians(15.0), duration=15.0)
    assert flight.offset.max() < 2.2
    assert np.ptp(flight.offset[flight.time > 12.0]) < 0.02


@pytest.mark.parametrize("airspeed", [3.0, 8.0, 15.0, 22.0, 25.0])
def test_a_corner_of_20_degrees_may_be_turned_at_once(airspeed):
    assert fly(on_leg(airspeed, course=math.radians(20.0)), airspeed, duration=15.0).converged()


def test_it_flies_the_first_order_actuators_too():
    a = load("nominal-first-order").parameters
    rng = np.random.default_rng(3)
    for airspeed in (5.0, 12.0, 20.0):
        for _ in range(10):
            assert fly(disturb(on_leg(airspeed), rng, **SIZES), airspeed, duration=8.0, a=a).converged()


def test_it_stays_on_the_leg_with_every_coefficient_a_fifth_wrong():
    rng = np.random.default_rng(5)
    names = "m", "J1", "J2", "J3", "C_l", "C_d0", "xi_f", "xi_m", "Delta_r", "k_f", "k_m", "a_y", "p_y"
    for airspeed in (8.0, 12.0, 18.0):
        for _ in range(15):
            a = NOMINAL._replace(**{name: getattr(NOMINAL, name) * rng.uniform(0.8, 1.2) for name in names})
            flight = fly(disturb(on_leg(airspeed), rng, **SIZES), airspeed, duration=15.0, a=a)
            assert flight.offset[-1] < 5.0
            assert np.linalg.norm(flight.x[-1, 8:]) < 0.05
