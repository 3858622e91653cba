"""The quasi-steady flight of the point mass against the model of forces and moments."""

import math
import random

import pytest

from sitl.design.trim import level_trim
from sitl.model.aerodynamics import wrench
from sitl.model.airframe_files import load
from sitl.model.battery import shaft_power
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, add_scaled, cross, dot, norm, scaled, subtract
from sitl.prediction.equilibrium import back, equilibrium, level, power, steady_power, weight, wind_force

A = load("nominal").parameters
STILL = Vector(0.0, 0.0, 0.0)


def given(nose, ahead, v_a, thrust, elevons):
    """Force in the world and moment in the body of an attitude with both motors at a thrust."""
    z = back(nose, ahead)
    y = cross(z, nose)
    speed = math.sqrt(thrust / A.k_f)
    body = Vector(dot(v_a, nose), dot(v_a, y), dot(v_a, z))
    F, M = wrench(body, STILL, Actuators(speed, speed, elevons, elevons), A)
    return add(add(scaled(nose, F.x), scaled(y, F.y)), scaled(z, F.z)), M


def test_the_model_gives_the_force_without_a_moment():
    """But for the drag of the elevons, which is left out: half a percent."""
    draw = random.Random(1)
    for _ in range(100):
        v_a = Vector(draw.uniform(0.0, 15.0), draw.uniform(-2.0, 2.0), draw.uniform(-2.0, 3.0))
        asked = Vector(draw.uniform(-1.0, 2.0), draw.uniform(-2.0, 2.0), draw.uniform(-1.0, 2.0))
        force, ahead = add_scaled(weight(A), asked, A.m), level(draw.uniform(-0.5, 0.5))
        held = equilibrium(force, v_a, ahead, A)
        if held.thrust < A.k_f * A.omega_min * A.omega_min:
            continue
        got, moment = given(held.nose, ahead, v_a, held.thrust, held.elevons)
        assert norm(held.nose) == pytest.approx(1.0)
        assert norm(subtract(got, force)) < 0.01 * norm(force)
        assert norm(moment) < 1e-12


@pytest.mark.parametrize("speed", [0.0, 3.0, 8.0, 15.0, 20.0])
def test_level_flight_is_that_of_the_trim(speed):
    trim, held = level_trim(A, speed), equilibrium(weight(A), Vector(speed, 0.0, 0.0), level(0.0), A)
    assert held.thrust == pytest.approx(trim.thrust, rel=0.01)
    assert held.elevons == pytest.approx(trim.delta, rel=0.02, abs=1e-9)


def test_a_hover_in_calm_is_upright_and_needs_no_elevons():
    held = equilibrium(weight(A), STILL, level(0.7), A)
    assert held.nose == pytest.approx((0.0, 0.0, 1.0))
    assert held.elevons == 0.0
    assert 2.0 * (1.0 - A.S_ratio * A.C_d0) * held.thrust == pytest.approx(A.m * A.g)


def test_power_is_that_of_the_motors_within_their_limits():
    speed = 0.5 * (A.omega_min + A.omega_max)
    of_motors = shaft_power(Actuators(speed, speed, 0.0, 0.0), 0.0, A)
    assert power(A.k_f * speed * speed, 0.0, A) == pytest.approx(of_motors)
    assert power(0.0, 0.0, A) == power(A.k_f * A.omega_min * A.omega_min, 0.0, A) > 0.0
    assert power(1e3, 0.0, A) == power(A.k_f * A.omega_max * A.omega_max, 0.0, A)
    assert steady_power(Vector(15.0, 0.0, 0.0), level(0.0), A) == pytest.approx(23.4, rel=0.02)  # the trim's


def test_a_wind_pushes_across_the_wing_and_not_along_it():
    across, along = (wind_force(Vector(3.0, 0.0, 0.0), heading, A) for heading in (0.0, 0.5 * math.pi))
    assert across.x > 0.3
    assert norm(along) == pytest.approx(0.0, abs=1e-9)
    assert norm(wind_force(STILL, 1.0, A)) == pytest.approx(0.0, abs=1e-12)
    turned = wind_force(Vector(0.0, 3.0, 0.0), 0.5 * math.pi, A)
    assert turned == pytest.approx((0.0, across.x, across.z), abs=1e-9)
