"""The jet of a wind wall against published jets."""

import math

import pytest

from sitl.enclosure.arena_files import outlet_of
from sitl.enclosure.wind_wall import error_function, speed_share
from sitl.model.vectors import Vector

HIGH = 1000.0  # so far up that the floor mirrors nothing [m]


def share(x, y=0.0, z=0.0, *, size=1.0, course=0.0):
    outlet = outlet_of(0.0, 0.0, HIGH, course, size, size)
    c, s = math.cos(course), math.sin(course)
    return speed_share(outlet, Vector(x * c - y * s, x * s + y * c, HIGH + z))


@pytest.mark.parametrize("x", [-3.0, -0.5, -1e-3, 0.0, 0.1, 0.7, 1.5, 4.0, 1e3])
def test_the_error_function(x):
    assert error_function(x) == pytest.approx(math.erf(x), abs=3e-7)


@pytest.mark.parametrize("distance", [20.0, 40.0, 80.0])
def test_far_away_it_decays_as_round_jets_do(distance):
    """U / U_0 = B d / x with B of 5.8 to 6.1 (Hussein, Capp and George 1994; Panchapakesan and Lumley 1993)."""
    diameter = 2.0 / math.sqrt(math.pi)  # of a round outlet of the same area
    assert 5.7 < share(distance) * distance / diameter < 6.2


def test_far_away_it_is_as_wide_as_round_jets_are():
    """The half-velocity radius is 0.094 to 0.102 of the distance there."""
    centre, low, high = share(40.0), 0.0, 40.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if share(40.0, middle) > 0.5 * centre else (low, middle)
    assert 0.092 < low / 40.0 < 0.104


def test_near_it_there_is_a_core_and_a_mixing_layer():
    """Speeds of 0.1 and 0.9 are 0.15 x (Liepmann, Laufer 1947) to 0.20 x apart (Wygnanski, Fiedler 1970)."""
    assert share(3.0, size=3.0) == pytest.approx(1.0, abs=1e-3)

    def edge(wanted):
        low, high = -1.5, 1.5
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if share(3.0, 1.5 + middle, size=3.0) > wanted else (low, middle)
        return low

    assert 0.14 < (edge(0.1) - edge(0.9)) / 3.0 < 0.21


def test_it_keeps_its_momentum():
    ys = [-4.0 + 0.05 * k for k in range(161)]
    flux = sum(share(10.0, y, z, size=1.0) ** 2 for y in ys for z in ys) * 0.05**2
    assert flux == pytest.approx(1.0, rel=5e-3)


def test_it_blows_where_it_is_turned_to_and_not_behind():
    assert share(5.0, 0.3, 0.2, course=2.0) == pytest.approx(share(5.0, 0.3, 0.2))
    assert share(-0.1) == 0.0
    assert share(5.0, 5.0) < 1e-3


def test_the_floor_mirrors_it():
    low = outlet_of(0.0, 0.0, 0.5, 0.0, 1.0, 1.0)
    on_floor, free = speed_share(low, Vector(10.0, 0.0, 0.0)), share(10.0, 0.0, -0.5)
    assert on_floor == pytest.approx(math.sqrt(2.0) * free, rel=1e-6)
