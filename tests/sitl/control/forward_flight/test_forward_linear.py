"""The linear forward law: its frame, its wind triangle, its Lyapunov value and its tick."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control.allocation import BOOST, Virtual, allocate
from sitl.control.forward_flight import forward_linear as law
from sitl.control.forward_flight.forward_linear import ForwardError
from sitl.control.reference import circle, hover_at, leg
from sitl.design.forward_schedule import forward_gains, model
from sitl.design.trim import level_trim
from sitl.model.airframe_files import load
from sitl.model.plant import derivative
from sitl.model.quaternions import from_euler, multiply, normalised, rotate
from sitl.model.state import Body
from sitl.model.vectors import Vector, add, add_scaled, dot, level_norm, norm, scaled
from tests.support.flights.estimates import estimate, negated, quaternion, turned, vector

NOMINAL = load("nominal").parameters
GAINS = forward_gains(NOMINAL)
STATES = len(ForwardError._fields)
ORIGIN = Vector(0.0, 0.0, 1000.0)
NOTHING = Vector(0.0, 0.0, 0.0)
NONE = (0.0,) * STATES
angles = st.floats(-math.pi, math.pi)
climbs = st.floats(-0.3, 0.7)
small = st.builds(Vector, *[st.floats(-1.0, 1.0)] * 3)


def direction(course, climb):
    return Vector(math.cos(climb) * math.cos(course), math.cos(climb) * math.sin(course), math.sin(climb))


def a_leg(airspeed, course=0.0, climb=0.0):
    """A leg through the origin of these tests."""
    return leg(ORIGIN, add_scaled(ORIGIN, direction(course, climb), 100.0), airspeed)


def trimmed(airspeed, course=0.0, climb=0.0, wind=NOTHING):
    """The estimate in the law's own trim at the beginning of a leg, and what the trim commands, (4,)."""
    u = law.wind_triangle(wind, direction(course, climb), airspeed)
    steep, azimuth = math.atan2(u.z, level_norm(u.x, u.y)), math.atan2(u.y, u.x)
    at = law.cell(airspeed, GAINS.speeds), law.cell(steep, GAINS.climbs)
    theta, thrust, delta = (law.bilinear(table, *at) for table in (GAINS.theta, GAINS.thrust, GAINS.delta))
    omega = math.sqrt(max(thrust, 0.0) / NOMINAL.k_f)
    q = from_euler(0.0, -theta, azimuth)
    seen = estimate(ORIGIN, add(u, wind), q, wind=wind, actuators=(omega, omega, delta, delta))
    return seen, np.array((thrust, thrust, delta, delta))


def disturbed(seen, rng):
    """The same 3 m, 1 m/s, 25 deg and 1 rad/s off."""
    off, slow, tilt, turn = (vector(v / np.linalg.norm(v)) for v in rng.normal(size=(4, 3)))
    return seen._replace(
        position=add_scaled(seen.position, off, 3.0),
        velocity=add(seen.velocity, slow),
        attitude=turned(seen.attitude, scaled(tilt, math.radians(25.0))),
        rates=add(seen.rates, turn),
    )


def random_error(seed):
    return ForwardError(*np.random.default_rng(seed).normal(size=STATES).tolist())


def control(x, airspeed, climb=0.0):
    return np.array(law.control(x, airspeed, climb, GAINS))


# The frame


@given(speed=st.floats(1.0, 25.0), course=angles, climb=climbs, wind=small)
def test_flying_the_leg_is_no_error_and_needs_the_trim(speed, course, climb, wind):
    seen, trim = trimmed(speed, course, climb, scaled(wind, 0.5))
    x, steep = law.error(seen, a_leg(speed, course, climb), GAINS)
    assert x == pytest.approx(NONE, abs=1e-9)
    assert control(x, speed, steep) == pytest.approx(trim, abs=1e-9)


@given(turn=angles, course=angles, climb=climbs, wind=small, seed=st.integers(0, 99))
def test_the_law_knows_no_north(turn, course, climb, wind, seed):
    wind, q_z = scaled(wind, 3.0), from_euler(0.0, 0.0, turn)
    seen = disturbed(trimmed(9.0, course, climb)[0], np.random.default_rng(seed))._replace(wind=wind)
    x, steep = law.error(seen, a_leg(10.0, course, climb), GAINS)
    moved = seen._replace(
        position=add(ORIGIN, rotate(q_z, add_scaled(seen.position, ORIGIN, -1.0))),
        velocity=rotate(q_z, seen.velocity),
        attitude=multiply(q_z, seen.attitude),
        wind=rotate(q_z, wind),
    )
    again, same = law.error(moved, a_leg(10.0, course + turn, climb), GAINS)
    assert again == pytest.approx(x, abs=1e-8)
    assert same == pytest.approx(steep, abs=1e-12)


@given(course=angles, tilt=small)
def test_the_attitude_error_is_a_turn_of_the_body_whatever_the_sign_of_q(course, tilt):
    seen = trimmed(7.0, course)[0]
    seen = seen._replace(attitude=turned(seen.attitude, tilt))
    x, _ = law.error(seen, a_leg(7.0, course), GAINS)
    assert x[5:8] == pytest.approx(0.5 * np.sinc(0.5 * norm(tilt) / math.pi) * np.array(tilt), abs=1e-12)
    other = law.error(seen._replace(attitude=negated(seen.attitude)), a_leg(7.0, course), GAINS)[0]
    assert other == pytest.approx(x, abs=1e-12)


def test_offsets_are_left_of_the_leg_and_square_to_it():
    course, climb = 0.5 * math.pi, math.radians(30.0)
    path, seen = a_leg(10.0, course, climb), trimmed(10.0, course, climb)[0]
    off = seen._replace(position=add(ORIGIN, Vector(-2.0, 0.0, 1.0)))  # flying west, south is left
    x, _ = law.error(off, path, GAINS)
    assert x[:2] == pytest.approx([2.0, math.cos(climb)])
    along = off._replace(position=add_scaled(off.position, direction(course, climb), 50.0))
    assert law.error(along, path, GAINS)[0] == pytest.approx(x)


def test_a_leg_without_length_heads_north_and_one_straight_up_has_no_course():
    seen = trimmed(10.0)[0]
    for end in (ORIGIN, add(ORIGIN, Vector(0.0, 0.0, 30.0))):
        x, steep = law.error(seen, leg(ORIGIN, end, 10.0), GAINS)
        assert all(math.isfinite(value) for value in x)
        assert steep == pytest.approx(0.0 if end == ORIGIN else 0.5 * math.pi)


@pytest.mark.parametrize("speed", [0.0, 3.0, 5.5, 12.0, 25.0])
def test_the_model_is_the_plant_in_the_law_s_coordinates(speed):
    """The error moves along the plant's flow as A x says."""
    A, _ = model(NOMINAL, level_trim(NOMINAL, speed))
    for column in range(STATES):
        x, moved = 1e-4 * np.eye(STATES)[column], {}
        for sign in (1.0, -1.0):
            seen = _deviated(speed, sign * x)
            ahead, behind = (np.array(law.error(_later(seen, dt), a_leg(speed), GAINS)[0]) for dt in (1e-4, -1e-4))
            moved[sign] = (ahead - behind) / 2e-4
        assert (moved[1.0] - moved[-1.0]) / 2e-4 == pytest.approx(A[:, column], abs=2e-3, rel=1e-4)


def _deviated(speed, x):
    """The estimate, flying north, whose error is x."""
    seen, e = trimmed(speed)[0], x[5:8]
    return seen._replace(
        position=add(seen.position, Vector(0.0, *x[:2].tolist())),
        velocity=add(seen.velocity, vector(x[2:5])),
        attitude=multiply(seen.attitude, quaternion((math.sqrt(1.0 - e @ e), *e))),
        rates=vector(x[8:]),
    )


def _later(seen, dt):
    """The plant's state a short time later."""
    now = (seen.position, seen.velocity, seen.attitude, seen.rates)
    rate = derivative(Body(*now), seen.actuators, seen.wind, NOTHING, NOTHING, NOMINAL)
    p, v, q, w = (np.array(x) + dt * np.array(dx) for x, dx in zip(now, rate, strict=True))
    return seen._replace(position=vector(p), velocity=vector(v), attitude=normalised(quaternion(q)), rates=vector(w))


# The wind triangle


@given(course=angles, climb=climbs, wind=small, speed=st.floats(5.0, 25.0))
def test_air_velocity_and_wind_add_up_to_the_leg(course, climb, wind, speed):
    wind, along = scaled(wind, 2.5), direction(course, climb)
    u = law.wind_triangle(wind, along, speed)
    ground = add(u, wind)
    assert norm(u) == pytest.approx(speed)
    assert ground == pytest.approx(scaled(along, dot(ground, along)), abs=1e-9)
    assert dot(ground, along) > 0.0


def test_a_cross_wind_beyond_the_airspeed_is_fought_with_all_of_it():
    u = law.wind_triangle(Vector(0.0, 8.0, 0.0), Vector(1.0, 0.0, 0.0), 5.0)
    assert u == pytest.approx((0.0, -5.0, 0.0))
    assert law.wind_triangle(NOTHING, direction(0.3, 0.1), 0.0) == (0.0, 0.0, 0.0)


# The Lyapunov value


@given(speed=st.floats(0.0, 25.0), seed=st.integers(0, 99))
def test_v_is_the_whole_quadratic_form(speed, seed):
    x, (_, S) = random_error(seed), law.scheduled(GAINS, speed)
    assert (S == S.T).all()
    assert law.quadratic(x, speed, GAINS) == pytest.approx(np.array(x) @ S @ np.array(x), rel=1e-9)


def test_v_is_of_the_leg_and_infinite_on_a_circle():
    seen = disturbed(trimmed(12.0)[0], np.random.default_rng(4))
    following = hover_at(ORIGIN, 0.0)._replace(forward=True, path=a_leg(12.0))
    x, _ = law.error(seen, following.path, GAINS)
    assert law.lyapunov(seen, following, GAINS) == law.quadratic(x, 12.0, GAINS) > 0.0
    turning = following._replace(path=circle(ORIGIN, 40.0, 12.0))
    assert law.lyapunov(seen, turning, GAINS) == math.inf


# The tick


@pytest.mark.parametrize("speed", [2.0, 8.0, 15.0, 22.0])
def test_in_its_trim_it_commands_the_trim(speed):
    seen, _ = trimmed(speed)
    command, saturation = law.step(seen, hover_at(ORIGIN, 0.0)._replace(path=a_leg(speed)), GAINS, NOMINAL)
    assert command == pytest.approx(seen.actuators)
    assert saturation & ~BOOST == 0


def test_its_deflections_are_those_of_the_law_where_a_thrust_is_beyond_the_motors():
    """Elevons are not divided by a thrust that cannot be had."""
    seen, _ = trimmed(20.0)
    fast = seen._replace(velocity=scaled(seen.velocity, 1.3))
    path = a_leg(20.0)
    T1, T2, d1, d2 = control(*_error_and_speed(fast, path))
    low = NOMINAL.k_f * NOMINAL.omega_min**2
    assert low > T1
    command, saturation = law.step(fast, hover_at(ORIGIN, 0.0)._replace(path=path), GAINS, NOMINAL)
    assert (command, saturation) == allocate(Virtual(T1, T2, d1 * low, d2 * low), NOMINAL)
    assert command[2:] == pytest.approx((d1, d2))


def _error_and_speed(seen, path):
    x, steep = law.error(seen, path, GAINS)
    return x, path.airspeed, steep


def test_an_offset_is_shortened_to_a_reach_however_short():
    gains, aside = GAINS._replace(reach=0.25), ForwardError(0.3, 0.4, *NONE[2:])
    at_reach = ForwardError(0.15, 0.2, *NONE[2:])
    assert law.control(aside, 15.0, 0.0, gains) == pytest.approx(law.control(at_reach, 15.0, 0.0, GAINS))
