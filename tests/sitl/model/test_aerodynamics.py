"""The forces and moments of the air against a second transcription, and against invariants."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.model import aerodynamics
from sitl.model.aerodynamics import force_matrix, moment_matrix
from sitl.model.airframe_files import load
from sitl.model.phi_theory import effective_speed, passive_wrench
from sitl.model.phi_theory import wrench as phi_theory_wrench
from sitl.model.state import Actuators
from sitl.model.vectors import Vector
from tests.support.flights import phi_theory
from tests.support.flights.estimates import vector
from tests.support.flights.plant_flight import actuators

NOMINAL, PUBLISHED = load("nominal").parameters, load("published").parameters
FULL = NOMINAL._replace(C_y0=0.3, C_lq=0.2, C_mp=0.1, C_mr=0.15, C_nq=0.05)  # no coefficient is zero
SETTINGS = settings(max_examples=60)
STILL, OFF = Vector(0.0, 0.0, 0.0), Actuators(0.0, 0.0, 0.0, 0.0)

speeds, rates = st.floats(-20, 20), st.floats(-6, 6)
motors, elevons = st.floats(200, 1000), st.floats(-0.5, 0.5)
vectors = st.builds(Vector, speeds, speeds, speeds)
spins = st.builds(Vector, rates, rates, rates)
controls = st.builds(Actuators, motors, motors, elevons, elevons)


def wrench(v, w, u, a):
    """Forces and moments, (6,)."""
    return np.concatenate(aerodynamics.wrench(v, w, u, a))


def virtual(u, a):
    """T1, T2, d1 T1, d2 T2."""
    T = a.k_f * np.square(u[:2])
    return np.array([*T, u[2] * T[0], u[3] * T[1]])


@SETTINGS
@given(vectors, spins, controls, st.sampled_from([NOMINAL, PUBLISHED, FULL]))
def test_the_scalar_equations_equal_the_reports_matrices(v, w, u, a):
    theirs = phi_theory.wrench(np.array(v), np.array(w), u[:2], u[2:], a)
    assert wrench(v, w, u, a) == pytest.approx(theirs, rel=1e-9, abs=1e-9)


@SETTINGS
@given(controls)
def test_at_rest_in_still_air_the_plant_is_the_hover_model(u):
    full = wrench(STILL, STILL, u, NOMINAL)
    assert full[:3] == pytest.approx(force_matrix(NOMINAL) @ virtual(u, NOMINAL), abs=1e-12)
    assert full[3:] == pytest.approx(moment_matrix(NOMINAL) @ virtual(u, NOMINAL), abs=1e-12)


def test_a_straight_and_an_arc_wing_have_the_same_input_matrices():
    """Appendix C: the arc wing's Delta turns T sideways too; C_y0 = 0 keeps that from any force or moment."""
    T, delta = np.array([2.4, 0.0, 0.0]), 0.2
    Phi_fv = np.diag([NOMINAL.C_d0, NOMINAL.C_y0, NOMINAL.C_l])
    straight = np.array([[0, 0, 1], [0, 0, 0], [-1, 0, 0]]) * NOMINAL.xi_f * delta
    arc = np.array([[0, -1, 1], [1, 0, -1], [-1, 1, 0]]) * NOMINAL.xi_f * delta
    assert Phi_fv @ straight @ T == pytest.approx(Phi_fv @ arc @ T)
    arm = phi_theory.skew([0.0, NOMINAL.a_y, 0.0])
    assert arm @ Phi_fv @ straight @ T == pytest.approx(arm @ Phi_fv @ arc @ T)


@SETTINGS
@given(vectors, spins, controls)
def test_left_and_right_mirror_each_other(v, w, u):
    ours = wrench(v, w, u, NOMINAL)
    swapped = actuators((u[1], u[0], u[3], u[2]))
    mirrored = wrench(Vector(v.x, -v.y, v.z), Vector(-w.x, w.y, -w.z), swapped, NOMINAL)
    assert mirrored * (1, -1, 1, -1, 1, -1) == pytest.approx(ours, rel=1e-9, abs=1e-9)


@SETTINGS
@given(vectors, spins)
def test_the_air_takes_energy_and_never_gives_it(v, w):
    """With motors and elevons at rest, power of the aerodynamic forces is never positive at mu = 0, w = 0."""
    assert wrench(v, STILL, OFF, NOMINAL)[:3] @ v <= 1e-9
    damped = NOMINAL._replace(C_lr=0.0, C_np=0.0)
    assert wrench(Vector(1e-9, 0.0, 0.0), w, OFF, damped)[3:] @ w <= 1e-9


def test_the_effective_speed_counts_the_rates_by_mu():
    a = NOMINAL._replace(mu=2.0)
    eta = effective_speed(vector((3.0, 4.0, 0.0)), vector((6.0, 0.0, 8.0)), a)
    assert eta == pytest.approx(np.sqrt(25.0 + 2.0 * a.c**2 * 100.0))


@SETTINGS
@given(vectors, spins, controls)
def test_left_and_right_mirror_each_other_in_the_passive_form_too(v, w, u):
    ours = np.concatenate(passive_wrench(v, w, u, NOMINAL))
    swapped = actuators((u[1], u[0], u[3], u[2]))
    mirrored = passive_wrench(Vector(v.x, -v.y, v.z), Vector(-w.x, w.y, -w.z), swapped, NOMINAL)
    assert np.concatenate(mirrored) * (1, -1, 1, -1, 1, -1) == pytest.approx(ours, rel=1e-9, abs=1e-9)


def test_at_rest_in_still_air_both_forms_are_one():
    u = Actuators(650.0, 520.0, 0.2, -0.1)
    passive = np.concatenate(passive_wrench(STILL, STILL, u, FULL))
    assert passive == pytest.approx(np.concatenate(phi_theory_wrench(STILL, STILL, u, FULL)), abs=1e-12)
