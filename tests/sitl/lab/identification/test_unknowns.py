"""Properties of an airframe that a flight can identify, and those that it cannot."""

import math

import numpy as np
import pytest

from sitl.errors import SitlError
from sitl.lab.identification.replay import accelerations
from sitl.lab.identification.unknowns import airframe_at, of_mass, unknowns_of, value_at, value_of, with_values
from sitl.model.airframe_files import load

SETS = ["collage", "darko", "nominal", "passive"]


@pytest.mark.parametrize("name", SETS)
def test_no_sensor_tells_the_mass(name):
    a = load(name).parameters
    random = np.random.default_rng(1)
    v, w = 8.0 * random.standard_normal((50, 3)), 2.0 * random.standard_normal((50, 3))
    actuators = random.uniform([200.0, 200.0, -0.5, -0.5], [800.0, 800.0, 0.5, 0.5], (50, 4))
    for one, other in zip(
        accelerations(v, w, actuators, a), accelerations(v, w, actuators, of_mass(a, 0.7)), strict=True
    ):
        assert other == pytest.approx(one, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", [*SETS, "published", "nominal-first-order"])
def test_a_vehicle_of_another_mass_is_among_those_looked_for(name):
    """Whatever no mass tells apart must be an unknown, or a flight of another mass is of no set that is tried."""
    a = load(name).parameters
    same = of_mass(a._replace(m=1.2 * a.m), a.m)
    values = {one.key: value_of(same, one.key) for one in unknowns_of(a)}
    random = np.random.default_rng(1)
    v, w = 8.0 * random.standard_normal((50, 3)), 2.0 * random.standard_normal((50, 3))
    actuators = random.uniform([300.0, 300.0, -0.5, -0.5], [1200.0, 1200.0, 0.5, 0.5], (50, 4))
    for found, flown in zip(
        accelerations(v, w, actuators, with_values(a, values)), accelerations(v, w, actuators, same), strict=True
    ):
        assert found == pytest.approx(flown, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", [*SETS, "published", "nominal-first-order"])
def test_at_zero_it_is_the_set_and_each_unknown_moves_its_own_value(name):
    a = load(name).parameters
    unknowns = unknowns_of(a)
    assert airframe_at(a, unknowns, [0.0] * len(unknowns)) == pytest.approx(a)
    for i, one in enumerate(unknowns):
        x = [0.1 if i == j else 0.0 for j in range(len(unknowns))]
        moved = airframe_at(a, unknowns, x)
        assert moved != a
        if one.key != "advance":
            assert value_of(moved, one.key) == pytest.approx(value_at(a, one, 0.1))


def test_what_is_one_propellers_goes_together():
    a = load("collage").parameters
    unknowns = {one.key: one for one in unknowns_of(a)}
    more = airframe_at(a, [unknowns["k_f"], unknowns["advance"]], [math.log(1.2), math.log(0.9)])
    assert more.k_fvv / a.k_fvv == pytest.approx(1.2 * 0.81)
    assert more.k_mv / a.k_mv == pytest.approx(0.9)
    assert more.advance_knot * 0.9 == pytest.approx(a.advance_knot)


def test_actuators_are_asked_for_what_their_model_has():
    lagging = {one.key for one in unknowns_of(load("nominal-first-order").parameters)}
    limited = {one.key for one in unknowns_of(load("nominal").parameters)}
    assert lagging ^ limited == {"motor_tau", "elevon_tau", "omega_rate", "delta_rate"}


def test_what_is_known_is_no_unknown_and_a_wrong_key_is_refused():
    a = load("collage").parameters
    assert "J2" not in {one.key for one in unknowns_of(a, {"J2": 0.003, "m": 0.5})}
    with pytest.raises(SitlError, match="C_x is not one of m, g"):
        unknowns_of(a, {"C_x": 1.0})
