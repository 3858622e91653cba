"""The linear forward law: its frame, its wind triangle, its schedule, and what it holds on the full plant."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.airframe import load
from sitl.design.forward_linear import forward_gains, model
from sitl.design.trim import level_trim
from sitl.errors import SitlError
from sitl.kernels.quaternion import from_euler, from_rotation_vector, multiply, rotate
from sitl.kernels.rigid_body import derivative
from sitl.kernels.state import ACTUATOR, ANCHOR, P, Q, V, W
from sitl.laws import forward_linear as law
from tests.support.forward_flight import ALOFT, GAINS, NOMINAL, disturb, fly, on_leg

SIZES = {"offset": 3.0, "speed": 1.0, "attitude": math.radians(25.0), "rate": 1.0}
angles = st.floats(-math.pi, math.pi)
climbs = st.floats(-0.3, 0.7)
small = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)


def error(plant, *, wind=(0, 0, 0), course=0.0, climb=0.0, airspeed=10.0, gains=GAINS):
    """The deviation and the climb of the air velocity."""
    x, origin = np.empty(law.STATES), np.array((0.0, 0.0, ALOFT))
    return x, law.error(plant, np.array(wind, dtype=float), origin, course, climb, airspeed, gains, x)


def control(x, airspeed, climb=0.0, gains=GAINS):
    u = np.empty(4)
    law.control(x, airspeed, climb, gains, u)
    return u


def draws(airspeed, count, seed=1):
    """Flights from random states about the leg."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield fly(disturb(on_leg(airspeed), rng, **SIZES), airspeed, duration=8.0)


# The frame


@settings(deadline=None)
@given(speed=st.floats(1.0, 25.0), course=angles, climb=climbs, wind=small)
def test_flying_the_leg_is_no_error_and_needs_the_trim(speed, course, climb, wind):
    plant = on_leg(speed, course=course, climb=climb, wind=0.9 * wind)
    x, steep = error(plant, wind=0.9 * wind, course=course, climb=climb, airspeed=speed)
    assert x == pytest.approx(np.zeros(law.STATES), abs=1e-9)
    u, commanded = control(x, speed, steep), plant[ACTUATOR:ANCHOR]
    assert u[2:] == pytest.approx(commanded[2:])
    assert np.maximum(u[:2], 0.0) == pytest.approx(NOMINAL.k_f * commanded[:2] ** 2, abs=1e-9)


@settings(deadline=None)
@given(turn=angles, course=angles, climb=climbs, wind=small, seed=st.integers(0, 99))
def test_the_law_knows_no_north(turn, course, climb, wind, seed):
    plant = disturb(on_leg(9.0, course=course, climb=climb), np.random.default_rng(seed), **SIZES)
    x, steep = error(plant, wind=3.0 * wind, course=course, climb=climb)
    q_z, turned = from_euler(0.0, 0.0, turn), plant.copy()
    for vector in (P, V):
        turned[vector : vector + 3] = rotate(q_z, plant[vector : vector + 3])
    turned[Q:W] = multiply(q_z, plant[Q:W])
    again, same = error(turned, wind=rotate(q_z, 3.0 * wind), course=course + turn, climb=climb)
    assert again == pytest.approx(x, abs=1e-8)
    assert same == pytest.approx(steep, abs=1e-12)


@settings(deadline=None)
@given(course=angles, tilt=small)
def test_the_attitude_error_is_a_turn_of_the_body_whatever_the_sign_of_q(course, tilt):
    plant = on_leg(7.0, course=course)
    plant[Q:W] = multiply(plant[Q:W].copy(), from_rotation_vector(tilt))
    x, _ = error(plant, course=course, airspeed=7.0)
    size = float(np.linalg.norm(tilt))
    assert x[5:8] == pytest.approx(0.5 * np.sinc(0.5 * size / math.pi) * tilt, abs=1e-12)
    plant[Q:W] *= -1.0
    assert error(plant, course=course, airspeed=7.0)[0] == pytest.approx(x, abs=1e-12)


def test_offsets_are_left_of_the_leg_and_square_to_it():
    plant = on_leg(10.0, course=0.5 * math.pi, climb=math.radians(30.0))
    plant[P] -= 2.0  # flying west, south is left
    plant[P + 2] += 1.0
    x, _ = error(plant, course=0.5 * math.pi, climb=math.radians(30.0))
    assert x[:2] == pytest.approx([2.0, math.cos(math.radians(30.0))])
    plant[P : P + 3] += 50.0 * np.array((0.0, math.cos(math.radians(30.0)), 0.5))  # along the leg nothing changes
    assert error(plant, course=0.5 * math.pi, climb=math.radians(30.0))[0] == pytest.approx(x)


@pytest.mark.parametrize("speed", [0.0, 3.0, 5.5, 12.0, 25.0])
def test_the_model_is_the_plant_in_the_law_s_coordinates(speed):
    """The error moves along the plant's flow as A x says."""
    A, _ = model(NOMINAL, level_trim(NOMINAL, speed))
    for column in range(law.STATES):
        x, moved = 1e-4 * np.eye(law.STATES)[column], {}
        for sign in (1.0, -1.0):
            plant = _deviated(speed, sign * x)
            dx = np.empty(ACTUATOR)
            derivative(plant[:ANCHOR], plant, np.zeros(3), NOMINAL, dx)
            ahead, behind = plant.copy(), plant.copy()
            ahead[:ACTUATOR] += 1e-4 * dx
            behind[:ACTUATOR] -= 1e-4 * dx
            moved[sign] = (error(ahead, airspeed=speed)[0] - error(behind, airspeed=speed)[0]) / 2e-4
        assert (moved[1.0] - moved[-1.0]) / 2e-4 == pytest.approx(A[:, column], abs=2e-3, rel=1e-4)


def _deviated(speed, x):
    """The plant, flying north, whose error is x."""
    plant = on_leg(speed)
    plant[P + 1 : P + 3] += x[:2]
    plant[V:Q] += x[2:5]
    plant[Q:W] = multiply(plant[Q:W].copy(), np.array((math.sqrt(1.0 - x[5:8] @ x[5:8]), *x[5:8])))
    plant[W:ACTUATOR] += x[8:]
    return plant


# The wind triangle


@settings(deadline=None)
@given(course=angles, climb=climbs, wind=small, speed=st.floats(5.0, 25.0))
def test_air_velocity_and_wind_add_up_to_the_leg(course, climb, wind, speed):
    u = np.array(law.wind_triangle(2.5 * wind, course, climb, speed))
    leg = np.array((math.cos(climb) * math.cos(course), math.cos(climb) * math.sin(course), math.sin(climb)))
    ground = u + 2.5 * wind
    assert np.linalg.norm(u) == pytest.approx(speed)
    assert ground == pytest.approx(float(ground @ leg) * leg, abs=1e-9)
    assert ground @ leg > 0.0


def test_a_cross_wind_beyond_the_airspeed_is_fought_with_all_of_it():
    u = law.wind_triangle(np.array((0.0, 8.0, 0.0)), 0.0, 0.0, 5.0)
    assert u == pytest.approx((0.0, -5.0, 0.0))
    assert law.wind_triangle(np.zeros(3), 0.3, 0.1, 0.0) == (0.0, 0.0, 0.0)


# Gains


def test_every_speed_of_the_grid_and_between_is_stable():
    slowest = {}
    for speed in np.arange(0.0, 25.01, 0.25):
        A, B = model(NOMINAL, level_trim(NOMINAL, float(speed)))
        K, S = law.scheduled(GAINS, float(speed))
        slowest[speed] = np.linalg.eigvals(A - B @ K).real.max()
        assert np.linalg.eigvals(A - B @ K).real.min() > -130.0
        assert np.linalg.eigvalsh(S).min() > 0.0
    assert max(slowest.values()) == pytest.approx(-1.23, abs=0.01)


@pytest.mark.parametrize("climb", [-10.0, 20.0, 45.0])
def test_the_level_gains_hold_climbs_and_descents_too(climb):
    for speed in range(26):
        A, B = model(NOMINAL, level_trim(NOMINAL, float(speed), math.radians(climb)))
        assert np.linalg.eigvals(A - B @ law.scheduled(GAINS, float(speed))[0]).real.max() < -0.5


@settings(deadline=None)
@given(speed=st.floats(0.0, 25.0), climb=st.floats(-0.3, 0.75))
def test_between_the_grid_the_trims_are_nearly_the_trims(speed, climb):
    trim = level_trim(NOMINAL, speed, climb)
    u = control(np.zeros(law.STATES), speed, climb)
    assert u == pytest.approx([trim.thrust, trim.thrust, trim.delta, trim.delta], abs=0.008)


@settings(deadline=None)
@given(speed=st.floats(0.0, 24.9), seed=st.integers(0, 99))
def test_the_schedule_has_no_steps(speed, seed):
    x = np.random.default_rng(seed).normal(size=law.STATES)
    assert control(x, speed + 1e-6, gains=GAINS) == pytest.approx(control(x, speed), abs=1e-3)
    assert law.lyapunov(x, speed + 1e-6, GAINS) == pytest.approx(law.lyapunov(x, speed, GAINS), rel=1e-4)


def test_beyond_the_grid_the_schedule_is_its_end():
    x = np.full(law.STATES, 0.1)
    assert (control(x, 40.0, 2.0) == control(x, 25.0, math.radians(45.0))).all()
    assert (control(x, -1.0, -2.0) == control(x, 0.0, math.radians(-30.0))).all()


@settings(deadline=None)
@given(speed=st.floats(0.0, 25.0), direction=angles, distance=st.floats(0.0, 100.0))
def test_the_law_is_linear_within_reach_and_constant_beyond(speed, direction, distance):
    x = np.zeros(law.STATES)
    x[:2] = distance * math.cos(direction), distance * math.sin(direction)
    x[8] = 0.3
    seen = x.copy()
    seen[:2] *= min(1.0, GAINS.reach / max(distance, 1e-9))
    trim, (K, _) = control(np.zeros(law.STATES), speed), law.scheduled(GAINS, speed)
    assert control(x, speed) == pytest.approx(trim - K @ seen, rel=1e-9, abs=1e-9)


def test_a_set_that_nothing_balances_in_level_flight_has_no_forward_law():
    with pytest.raises(SitlError, match=r"no forward law: nothing balances level flight at \d"):
        forward_gains(load("report-table").parameters)


# Flights of the full plant


@pytest.mark.parametrize("speed", [1.0, 3.0, 5.5, 8.0, 10.0, 12.0, 15.0, 18.0, 22.0, 25.0])
def test_it_comes_back_to_the_leg_and_v_falls(speed):
    """From 3 m, 1 m/s, 25 deg and 1 rad/s in random directions."""
    for flight in draws(speed, 40):
        assert flight.converged()
        V = flight.lyapunov[flight.time >= 1.0]
        assert (np.diff(V) < 1e-9)[V[1:] > 1e-4].all()


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
            assert fly(on_leg(airspeed), airspeed, wind=wind, told=(0, 0, 0), duration=12.0).offset[-1] < 0.6


@pytest.mark.parametrize("airspeed", [5.5, 8.0, 12.0, 20.0])
def test_far_from_the_leg_it_approaches_at_an_angle(airspeed):
    for axis in (P + 1, P + 2):
        plant = on_leg(airspeed)
        plant[axis] += 30.0
        flight = fly(plant, airspeed, duration=25.0)
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


def test_compiled_equals_python():
    plant = disturb(on_leg(9.3, course=0.4, climb=0.1), np.random.default_rng(4), **SIZES)
    wind, origin = np.array((1.0, -2.0, 0.5)), np.array((5.0, 6.0, ALOFT))
    x, python_x, python_u = np.empty(law.STATES), np.empty(law.STATES), np.empty(4)
    steep = law.error(plant, wind, origin, 0.4, 0.1, 9.3, GAINS, x)
    python = {
        name: getattr(getattr(law, name), "py_func", getattr(law, name)) for name in ("error", "control", "lyapunov")
    }
    assert python["error"](plant, wind, origin, 0.4, 0.1, 9.3, GAINS, python_x) == pytest.approx(steep, rel=1e-12)
    assert x == pytest.approx(python_x, rel=1e-9)
    python["control"](x, 9.3, steep, GAINS, python_u)
    assert control(x, 9.3, steep) == pytest.approx(python_u, rel=1e-9)
    assert law.lyapunov(x, 9.3, GAINS) == pytest.approx(python["lyapunov"](x, 9.3, GAINS), rel=1e-12)
    K, S = law.scheduled(GAINS, 9.3)
    assert law.lyapunov(x, 9.3, GAINS) == pytest.approx(x @ S @ x)
    near = np.concatenate((x[:2] * min(1.0, GAINS.reach / float(np.hypot(x[0], x[1]))), x[2:]))
    assert python_u == pytest.approx(control(np.zeros(law.STATES), 9.3, steep) - K @ near)
