"""The plant against a second transcription, against invariants, and on the ground."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.airframe import load
from sitl.kernels import actuators, airspeed_model, state
from sitl.kernels.aerodynamics import wrench
from sitl.kernels.ground import on_ground
from sitl.kernels.hover_model import force_matrix, inertia, moment_matrix
from sitl.kernels.integrate import plant_step
from sitl.kernels.quaternion import from_euler, hover, multiply, rotate, rotate_inverse
from sitl.kernels.wind import gust_step
from sitl.vehicle import standing_height
from tests.support import phi_theory

NOMINAL, PUBLISHED = load("nominal").parameters, load("published").parameters
FIRST_ORDER = load("nominal-first-order").parameters
FULL = NOMINAL._replace(C_y0=0.3, C_lq=0.2, C_mp=0.1, C_mr=0.15, C_nq=0.05)  # no coefficient is zero
VACUUM = NOMINAL._replace(rho=1e-12, k_f=1e-30, k_m=1e-30, S_ratio=1e-12)
SETTINGS = settings(deadline=None, max_examples=60)

speeds, rates = st.floats(-20, 20), st.floats(-6, 6)
motors, elevons = st.floats(200, 1000), st.floats(-0.5, 0.5)
vectors = st.tuples(speeds, speeds, speeds)
spins = st.tuples(rates, rates, rates)
controls = st.tuples(motors, motors, elevons, elevons)


def plant(p=(0.0, 0.0, 50.0), v=(0.0, 0.0, 0.0), q=None, w=(0.0, 0.0, 0.0), u=(0.0, 0.0, 0.0, 0.0)):
    x = np.full(state.SIZE, math.nan)
    x[:17] = (*p, *v, *(hover(0.0) if q is None else q), *w, *u)
    return x


def fly(x, a, seconds, command=(0.0,) * 4, wind=(0.0,) * 3, armed=True):
    command, wind = np.array(command, dtype=float), np.array(wind, dtype=float)
    for _ in range(round(seconds / 1e-3)):
        plant_step(x, command, wind, armed, a, 1e-3)
    return x


# Against the report


@SETTINGS
@given(vectors, spins, controls, st.sampled_from([NOMINAL, PUBLISHED, FULL]))
def test_the_scalar_kernel_equals_the_reports_matrices(v, w, u, a):
    ours = np.array(wrench(*v, *w, *u, a))
    theirs = phi_theory.wrench(np.array(v), np.array(w), u[:2], u[2:], a)
    assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-9)


@SETTINGS
@given(vectors, spins, controls)
def test_compiled_equals_plain_python(v, w, u):
    assert wrench(*v, *w, *u, NOMINAL) == pytest.approx(wrench.py_func(*v, *w, *u, NOMINAL), rel=1e-12, abs=1e-12)


@SETTINGS
@given(controls)
def test_at_rest_in_still_air_the_plant_is_the_hover_model(u):
    T = NOMINAL.k_f * np.square(u[:2])
    virtual = np.array([*T, u[2] * T[0], u[3] * T[1]])
    full = np.array(wrench(0, 0, 0, 0, 0, 0, *u, NOMINAL))
    assert full[:3] == pytest.approx(force_matrix(NOMINAL) @ virtual, abs=1e-12)
    assert full[3:] == pytest.approx(moment_matrix(NOMINAL) @ virtual, abs=1e-12)


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
@given(vectors, controls)
def test_without_rates_the_plant_is_the_airspeed_model(v, u):
    T1, T2 = NOMINAL.k_f * np.square(u[:2])
    virtual = airspeed_model.virtual_command(T1, T2, u[2], u[3])
    eta = float(np.linalg.norm(v))
    F = airspeed_model.force(np.array(v), eta, virtual, NOMINAL)
    M = airspeed_model.moment(np.array(v), eta, virtual, NOMINAL)
    assert np.concatenate((F, M)) == pytest.approx(np.array(wrench(*v, 0, 0, 0, *u, NOMINAL)), rel=1e-9, abs=1e-9)


@SETTINGS
@given(vectors, controls)
def test_the_airspeed_models_jacobian_is_its_moments_derivative(v, u):
    T1, T2 = NOMINAL.k_f * np.square(u[:2])
    at, eta, v = airspeed_model.virtual_command(T1, T2, u[2], u[3]), float(np.linalg.norm(v)), np.array(v)
    columns = []
    for k in (1, 2, 3):
        step = np.zeros(4)
        step[k] = 1e-5
        ahead, behind = (airspeed_model.moment(v, eta, at + sign * step, NOMINAL) for sign in (1, -1))
        columns.append((ahead - behind) / 2e-5)
    assert airspeed_model.moment_jacobian(v, eta, at, NOMINAL) == pytest.approx(np.array(columns).T, abs=1e-7)


def test_the_airspeed_models_jacobian_is_well_conditioned_where_the_printed_one_is_singular():
    """Eq. M_y as printed multiplies d1 + d2 by T1 - T2: with equal thrusts the elevons would not pitch in hover."""
    jacobian = airspeed_model.moment_jacobian(np.zeros(3), 0.0, np.array([4.85, 0.0, 0.0, 0.0]), NOMINAL)
    assert np.linalg.cond(jacobian) == pytest.approx(6.3, abs=0.1)


# Symmetries and conservation


@SETTINGS
@given(vectors, spins, controls)
def test_left_and_right_mirror_each_other(v, w, u):
    ours = wrench(*v, *w, *u, NOMINAL)
    mirrored = wrench(v[0], -v[1], v[2], -w[0], w[1], -w[2], u[1], u[0], u[3], u[2], NOMINAL)
    Fx, Fy, Fz, Mx, My, Mz = mirrored
    assert (Fx, -Fy, Fz, -Mx, My, -Mz) == pytest.approx(ours, rel=1e-9, abs=1e-9)


@settings(deadline=None, max_examples=10)
@given(st.floats(-3, 3), vectors)
def test_turning_the_world_turns_the_flight(heading, v):
    q = from_euler(0.1, -0.8, 0.3)
    turn = np.array((math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)))
    v = np.array(v)
    plain = fly(plant(v=v, q=q, u=(650, 700, 0.1, -0.1)), NOMINAL, 0.2, (650, 700, 0.1, -0.1))
    turned = fly(
        plant(v=rotate(turn, v), q=multiply(turn, q), u=(650, 700, 0.1, -0.1)), NOMINAL, 0.2, (650, 700, 0.1, -0.1)
    )
    assert rotate(turn, plain[3:6].copy()) == pytest.approx(turned[3:6], rel=1e-6, abs=1e-6)
    assert plain[10:13] == pytest.approx(turned[10:13], rel=1e-6, abs=1e-6)


@settings(deadline=None, max_examples=10)
@given(vectors)
def test_only_the_velocity_through_the_air_matters(wind):
    still = fly(plant(v=(3.0, 1.0, 0.0)), NOMINAL, 0.2, (650,) * 2 + (0.0,) * 2)
    moved = fly(plant(v=np.array((3.0, 1.0, 0.0)) + wind), NOMINAL, 0.2, (650,) * 2 + (0.0,) * 2, wind)
    assert moved[3:6] - wind == pytest.approx(still[3:6], abs=1e-9)
    assert moved[6:13] == pytest.approx(still[6:13], abs=1e-9)


def test_free_fall_in_a_vacuum_is_exact():
    x = fly(plant(v=(1.0, 2.0, 3.0)), VACUUM, 1.0)
    assert x[:3] == pytest.approx([1.0, 2.0, 53.0 - 0.5 * VACUUM.g], abs=1e-9)
    assert x[5] == pytest.approx(3.0 - VACUUM.g, abs=1e-9)


@settings(deadline=None, max_examples=8)
@given(spins)
def test_a_torque_free_tumble_keeps_angular_momentum_and_energy(w):
    x = plant(w=w)
    J = inertia(VACUUM)
    before = rotate(x[6:10].copy(), J * x[10:13]), 0.5 * x[10:13] @ (J * x[10:13])
    fly(x, VACUUM, 1.0)
    assert rotate(x[6:10].copy(), J * x[10:13]) == pytest.approx(before[0], abs=1e-9)
    assert 0.5 * x[10:13] @ (J * x[10:13]) == pytest.approx(before[1], abs=1e-9)
    assert np.linalg.norm(x[6:10]) == pytest.approx(1.0, abs=1e-12)


@SETTINGS
@given(vectors, spins)
def test_the_air_takes_energy_and_never_gives_it(v, w):
    """With motors and elevons at rest, power of the aerodynamic forces is never positive at mu = 0, w = 0."""
    Fx, Fy, Fz, *_ = wrench(*v, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, NOMINAL)
    assert Fx * v[0] + Fy * v[1] + Fz * v[2] <= 1e-9
    *_, Mx, My, Mz = wrench(1e-9, 0.0, 0.0, *w, 0.0, 0.0, 0.0, 0.0, NOMINAL._replace(C_lr=0.0, C_np=0.0))
    assert Mx * w[0] + My * w[1] + Mz * w[2] <= 1e-9


def test_two_equal_calls_are_bit_identical():
    runs = [fly(plant(v=(3.0, 0.0, 0.0), u=(600, 640, 0.1, 0.2)), NOMINAL, 0.5, (700, 690, 0.2, 0.1)) for _ in range(2)]
    assert runs[0].tobytes() == runs[1].tobytes()


@given(st.floats(-math.pi, math.pi))
def test_hover_points_the_nose_up_at_any_heading(heading):
    q = hover(heading)
    assert rotate(q, np.array((1.0, 0.0, 0.0))) == pytest.approx([0, 0, 1], abs=1e-12)
    assert rotate(q, np.array((0.0, 0.0, -1.0))) == pytest.approx([math.cos(heading), math.sin(heading), 0], abs=1e-12)


@SETTINGS
@given(vectors)
def test_rotating_back_gives_the_vector_again(v):
    q = from_euler(0.3, -1.0, 2.0)
    assert rotate_inverse(q, rotate(q, np.array(v))) == pytest.approx(np.array(v), abs=1e-9)


# The ground


@pytest.mark.parametrize("armed", [False, True])
def test_it_stands_without_sinking_or_sliding(armed):
    x = plant(p=(0.0, 0.0, standing_height(NOMINAL)))
    idle = (NOMINAL.omega_min,) * 2 + (0.0,) * 2
    fly(x, NOMINAL, 2.0, idle, armed=armed)
    settled = x.copy()
    fly(x, NOMINAL, 30.0, idle, armed=armed)
    assert x[:3] == pytest.approx(settled[:3], abs=1e-4)
    assert rotate(x[6:10].copy(), np.array((1.0, 0.0, 0.0)))[2] == pytest.approx(1.0, abs=1e-6)
    assert on_ground(x, NOMINAL)


def test_a_light_wind_does_not_move_it():
    x = fly(plant(p=(0.0, 0.0, standing_height(NOMINAL))), NOMINAL, 10.0, wind=(1.5, 0.0, 0.0), armed=False)
    assert np.hypot(x[0], x[1]) < 2e-3


def test_it_slides_only_beyond_friction():
    held, pushed = (
        fly(plant(p=(0.0, 0.0, standing_height(NOMINAL)), v=(0.0, v, 0.0)), NOMINAL, 2.0, armed=False)
        for v in (0.01, 1.0)
    )
    assert abs(held[1]) < 2e-3
    assert 0.05 < abs(pushed[1]) < 0.3
    assert np.linalg.norm(pushed[3:6]) < 0.05


def test_touching_down_at_half_a_metre_per_second_does_not_bounce_away():
    x = plant(p=(0.0, 0.0, standing_height(NOMINAL) + 0.05), v=(0.0, 0.0, -0.5))
    highest = 0.0
    for _ in range(15):
        fly(x, NOMINAL, 0.1, armed=False)
        highest = max(highest, x[2]) if on_ground(x, NOMINAL) else highest
    assert highest < standing_height(NOMINAL) + 0.02
    assert np.linalg.norm(x[3:6]) < 0.05


def test_tipped_over_it_lies_on_the_ground():
    x = plant(p=(0.0, 0.0, 0.2), q=from_euler(0.0, -0.4, 0.0))
    fly(x, NOMINAL, 6.0, armed=False)
    assert -0.02 < x[2] < 0.2
    assert np.linalg.norm(x[3:6]) < 0.1


# Actuators and wind


@given(st.lists(st.tuples(st.floats(0, 1500), st.floats(0, 1500), st.floats(-2, 2), st.floats(-2, 2)), max_size=20))
@settings(deadline=None, max_examples=40)
def test_actuators_never_leave_their_limits(commands):
    x = plant(u=(600, 600, 0, 0))
    for command in commands:
        before = x[13:17].copy()
        actuators.advance(x, np.array(command), True, 1e-3, NOMINAL)
        step = np.abs(x[13:17] - before)
        assert (step <= np.array([3.0, 3.0, 5.24e-3, 5.24e-3]) + 1e-8).all()
        assert (x[13:15] >= 200.0 - 1e-9).all()
        assert (x[13:15] <= 1000.0 + 1e-9).all()
        assert (np.abs(x[15:17]) <= NOMINAL.delta_max + 1e-12).all()


def test_limits_are_flagged_by_actuator():
    x = plant(u=(1000, 600, 0.0, -NOMINAL.delta_max))
    assert actuators.advance(x, np.array((1000.0, 600.0, 0.0, -1.0)), True, 1e-3, NOMINAL) == 1 | 8
    assert actuators.advance(x, np.array((999.0, 900.0, 0.5, 0.0)), True, 1e-3, NOMINAL) == 32 | 64 | 128


def test_a_first_order_motor_has_its_time_constant():
    x = plant(u=(400, 400, 0, 0))
    for _ in range(43):
        actuators.advance(x, np.array((500.0, 500.0, 0.0, 0.0)), True, 1e-3, FIRST_ORDER)
    assert (x[13] - 400.0) / 100.0 == pytest.approx(1.0 - math.exp(-1.0), abs=1e-6)


def test_disarmed_motors_run_down_to_a_stop():
    x = plant(u=(700, 700, 0, 0))
    for _ in range(400):
        actuators.advance(x, np.array((700.0, 700.0, 0.0, 0.0)), False, 1e-3, NOMINAL)
    assert x[13:15].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("dt", [0.002, 0.02])
def test_gusts_have_the_deviation_asked_for_at_any_step(dt):
    rng = np.random.default_rng(5)
    gust, seen = np.zeros(3), []
    for noise in rng.standard_normal((60_000, 3)):
        gust_step(gust, noise, 1.5, 0.5, 10.0, dt)
        seen.append(gust.copy())
    assert np.std(seen[2000:]) == pytest.approx(1.5, rel=0.04)
