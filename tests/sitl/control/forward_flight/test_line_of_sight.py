"""The line-of-sight law: the attitude of a force is that of the trims, and in a trim the law changes nothing."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.compiled import entry
from sitl.control.attitude_loop import observer_start, observer_update
from sitl.control.flatness import View
from sitl.control.forward_flight import forward_linear, line_of_sight
from sitl.control.forward_flight.line_of_sight import (
    TURN_RATE,
    LineOfSightState,
    attitude,
    brake_step,
    cruise_step,
    guarded,
    start,
)
from sitl.control.reference import circle, hover_at, leg
from sitl.design.forward_schedule import forward_gains
from sitl.design.gains import line_of_sight_gains
from sitl.design.trim import decelerating_trim, level_trim
from sitl.design.turn import turning_trim
from sitl.model.aerodynamics import slopes, trimmed_slope, wrench
from sitl.model.airframe_files import load
from sitl.model.arithmetic import decay
from sitl.model.quaternions import from_euler, hover, rotate, rotate_inverse, x_axis
from sitl.model.vectors import Vector, norm, subtract
from tests.support.flights.estimates import estimate, negated, quaternion, turned, vector

A = load("nominal").parameters
GAINS = line_of_sight_gains()
NOTHING = Vector(0.0, 0.0, 0.0)
SPAN = Vector(0.0, 1.0, 0.0)
SPEEDS = np.arange(0.0, 20.1, 0.5).tolist()
DT = 0.002


def carried(v_a):
    """Normal force of the trimmed wing by the velocity across it, which here does not depend on the incidence."""
    return trimmed_slope(slopes(v_a, 0.0, 0.0, A), A)


def view(heading, last=None):
    return View(heading, last or hover(heading), GAINS.blend_from, GAINS.blend_to)


def attitude_of(v_a, acceleration=(0.0, 0.0, 0.0), heading=0.0, last=None):
    force = vector(A.m * np.add(acceleration, (0.0, 0.0, A.g)))
    v_a = vector(v_a)
    return attitude(force, v_a, view(heading, last), carried(v_a), A)


def between(q, other):
    """Angle between two attitudes [deg]; 360 where one is the other's negative."""
    return math.degrees(2.0 * math.acos(np.clip(np.dot(q, other), -1.0, 1.0)))


def northwards(speed, climb):
    return Vector(speed * math.cos(climb), 0.0, speed * math.sin(climb))


# The attitude of a force


@pytest.mark.parametrize("climb", np.radians((-20.0, -10.0, 0.0, 10.0, 30.0, 45.0)).tolist())
def test_the_attitude_of_straight_flight_is_the_trims(climb):
    for speed in SPEEDS:
        q = from_euler(0.0, -level_trim(A, speed, climb).theta, 0.0)
        assert between(attitude_of(northwards(speed, climb), last=q), q) < 1e-3, speed


@pytest.mark.parametrize("accel", [-2.0, -1.0, 1.0, 3.0])
def test_the_attitude_of_braking_and_speeding_up_is_the_trims(accel):
    for speed in SPEEDS:
        q = from_euler(0.0, -decelerating_trim(A, speed, accel).theta, 0.0)
        assert between(attitude_of((speed, 0.0, 0.0), (accel, 0.0, 0.0), last=q), q) < 1e-3, speed


@pytest.mark.parametrize("speed", [8.0, 12.0, 15.0, 20.0])
@pytest.mark.parametrize("rate", [-0.4, 0.2, 0.6])
def test_the_attitude_of_a_turn_is_the_trims_but_for_its_rates(speed, rate):
    """It banks as the steady turn does; the moments of the turning itself, which it leaves out, are a degree."""
    trim = quaternion(turning_trim(A, speed, rate).q)
    q = attitude_of((speed, 0.0, 0.0), (0.0, speed * rate, 0.0), last=trim)
    assert between(q, trim) < 1.0
    y = rotate(q, SPAN)
    assert y.z * rate < 0.0  # the left wing down into a left turn
    assert abs(y.x) < 1e-9  # without sideslip


@given(azimuth=st.floats(-3.1, 3.1), speed=st.floats(8.0, 20.0), vertical=st.floats(-2.0, 2.0))
def test_the_attitude_turns_with_the_air_stream(azimuth, speed, vertical):
    """In forward flight the heading it was told plays no part."""
    c, s = math.cos(azimuth), math.sin(azimuth)
    x = x_axis(attitude_of((speed * c, speed * s, vertical), heading=azimuth + 0.3))
    straight = x_axis(attitude_of((speed, 0.0, vertical)))
    assert x == pytest.approx((c * straight.x, s * straight.x, straight.z), abs=1e-9)


@given(heading=st.floats(-3.1, 3.1), wind=st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)))
def test_without_airspeed_to_go_by_the_belly_points_where_it_is_told(heading, wind):
    y = rotate(attitude_of((*wind, 0.0), heading=heading), SPAN)
    assert y == pytest.approx((-math.sin(heading), math.cos(heading), 0.0), abs=1e-9)


@pytest.mark.long(after=1)
@pytest.mark.parametrize("climb", [0.0, 0.2, -0.2])
@pytest.mark.parametrize("across", [0.0, 3.0, -3.0])
@pytest.mark.parametrize("heading", [0.0, 0.1])
def test_from_rest_to_cruise_the_attitude_never_jumps_nor_changes_its_sign(climb, across, heading):
    last = attitude_of(NOTHING, (0.0, across, 0.0), heading)
    for speed in np.arange(0.01, 20.0, 0.01).tolist():
        q = attitude_of(northwards(speed, climb), (0.0, across, 0.0), heading, last)
        assert between(q, last) < 0.25, speed
        last = q


@given(force=st.builds(Vector, *[st.floats(-20.0, 20.0)] * 3), v_a=st.builds(Vector, *[st.floats(-20.0, 20.0)] * 3))
def test_the_attitude_of_any_force_in_any_stream_is_a_rotation(force, v_a):
    q = attitude(force, v_a, view(0.5), carried(v_a), A)
    assert norm(force) < 1e-3 or math.sqrt(np.dot(q, q)) == pytest.approx(1.0, abs=1e-6)
    h = hover(0.5)
    # As the law adds: in which order np.dot does, and whether it rounds between, is the processor's affair.
    assert q.w * h.w + q.x * h.x + q.y * h.y + q.z * h.z >= 0.0


def test_a_force_along_the_air_stream_keeps_the_span_it_had():
    q = from_euler(0.3, -1.2, 0.8)
    down = Vector(0.0, 0.0, 12.0)
    fall = attitude(Vector(0.0, 0.0, A.m * A.g), down, view(0.0, q), carried(down), A)
    assert math.sqrt(np.dot(fall, fall)) == pytest.approx(1.0)


# The ticks


def in_trim(speed, p=(0.0, 0.0, 50.0), w=NOTHING):
    """The estimate in level flight northwards."""
    trim = level_trim(A, speed)
    motion = (speed, 0.0, 0.0), from_euler(0.0, -trim.theta, 0.0), w
    return estimate(p, *motion, actuators=(trim.omega, trim.omega, trim.delta, trim.delta))


def northward_leg(airspeed, heading=0.0):
    path = leg((0, 0, 50), (500, 0, 50), airspeed)
    return hover_at(path.end, heading)._replace(forward=True, path=path)


def flown(step, seen, reference, ticks, course=0.0):
    """Command, saturation, state and course after some ticks in which the vehicle stays as it is."""
    state = LineOfSightState(start(seen, A), course)
    for _ in range(ticks):
        command, saturation, state = step(seen, reference, GAINS, A, state, DT)
    return command, saturation, state.sight, state.course


@pytest.mark.parametrize("speed", [7.0, 10.0, 15.0, 20.0])
def test_in_a_trim_on_its_leg_it_commands_the_trim(speed):
    seen = in_trim(speed)
    command, _, sight, course = flown(cruise_step, seen, northward_leg(speed), 50)
    assert command == pytest.approx(seen.actuators, rel=0.01)
    assert sight.acceleration == pytest.approx(NOTHING, abs=1e-6)
    assert course == 0.0


@pytest.mark.parametrize("step", [cruise_step, brake_step])
def test_what_it_wants_changes_no_faster_than_its_jerk(step):
    seen = in_trim(15.0, (0.0, 20.0, 40.0))
    _, _, sight, _ = flown(step, seen, northward_leg(8.0), 10)
    assert 0.0 < norm(sight.acceleration) <= GAINS.guidance.max_jerk * DT * 10 + 1e-9


def test_it_starts_from_the_acceleration_and_the_attitude_there_are():
    seen = in_trim(12.0, w=(0.1, 0.2, 0.3))._replace(acceleration=Vector(1.0, -2.0, 0.5))
    sight = start(seen, A)
    assert sight.acceleration == seen.acceleration
    assert sight.attitude == seen.attitude
    assert (sight.turning, sight.integral) == (NOTHING, NOTHING)
    _, _, after, _ = flown(cruise_step, seen, northward_leg(12.0), 1)
    assert norm(subtract(after.acceleration, seen.acceleration)) == pytest.approx(GAINS.guidance.max_jerk * DT)


def test_a_dive_is_pulled_out_of_whatever_the_path_wants():
    wanted = Vector(1.0, 2.0, -3.0)
    assert guarded(Vector(12.0, 0.0, -3.0), wanted) == wanted
    assert guarded(Vector(20.0, 0.0, -5.0), wanted) == wanted  # fast, but not steep
    assert guarded(Vector(8.0, 0.0, -6.0), wanted) == (0.0, 0.0, 8.0)


@pytest.mark.parametrize(("heading", "course", "way"), [(1.0, 0.5, 1.0), (-3.0, 3.0, 1.0), (3.0, -3.0, -1.0)])
def test_at_the_end_of_the_braking_the_heading_goes_over_to_that_of_the_hover_the_short_way(heading, course, way):
    slow, fast = (estimate((490, 0, 50), (speed, 0, 0), actuators=(500, 500, 0, 0)) for speed in (2.9, 3.1))
    assert flown(brake_step, fast, northward_leg(15.0, heading), 10, course)[3] == course
    assert flown(brake_step, slow, northward_leg(15.0, heading), 10, course)[3] == pytest.approx(
        course + way * TURN_RATE * DT * 10
    )
    assert flown(brake_step, slow, northward_leg(15.0, course + 1e-4), 10, course)[3] == pytest.approx(course + 1e-4)


# The observer


@settings(max_examples=10)
@given(rates=st.builds(Vector, *[st.floats(-1.0, 1.0)] * 3), share=st.floats(0.2, 4.0))
def test_the_observer_finds_a_moment_that_the_model_does_not_know(rates, share):
    """A body whose rates stay as they are is held by what balances the model's moment: a lag of the bandwidth."""
    seen = in_trim(12.0, w=rates)
    _, M = wrench(rotate_inverse(seen.attitude, seen.velocity), rates, seen.actuators, A)
    unknown = np.cross(rates, np.array((A.J1, A.J2, A.J3)) * rates) - M
    z, bandwidth, dt = observer_start(seen, A), 8.0, 5e-4
    for _ in range(round(share / bandwidth / dt) + 1):
        found, z = observer_update(seen, z, bandwidth, A, dt)
    assert np.array(found) == pytest.approx(
        unknown * (1.0 - math.exp(-share)), abs=2e-3 * np.linalg.norm(unknown) + 1e-9
    )


# Compiled


@entry
def _ticks(seen, reference, gains, linear, a, sight):
    """A tick of every forward law."""
    state = LineOfSightState(sight, 0.3)
    cruising, braking = (
        cruise_step(seen, reference, gains, a, state, DT),
        brake_step(seen, reference, gains, a, state, DT),
    )
    level = forward_linear.step(seen, reference, linear, a), forward_linear.lyapunov(seen, reference, linear)
    return cruising, braking, level


@pytest.mark.long
def test_compiled_laws_give_the_bits_of_plain_python():
    rng, linear = np.random.default_rng(4), forward_gains(A)
    for _ in range(30):
        q = rng.normal(size=4)
        motion = rng.normal(size=3) * 8.0, q / np.linalg.norm(q), rng.normal(size=3)
        seen = estimate(
            rng.normal(size=3) * 50.0, *motion, rng.normal(size=3) * 3.0, (600, 500, *rng.normal(size=2) * 0.2)
        )
        legs = northward_leg(14.0)
        for reference in (legs, legs._replace(path=circle((0, 0, 50), -40.0, 12.0))):
            arguments = seen, reference, GAINS, linear, A, start(in_trim(9.0), A)
            assert _ticks(*arguments) == getattr(_ticks, "py_func", _ticks)(*arguments)


def test_the_heading_is_taken_over_at_a_radian_per_second():
    assert TURN_RATE == 1.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_attitude_s_own_rate_is_fed_forward_the_way_it_turns(sign):
    rate, dt = Vector(0.2 * sign, -0.3 * sign, 0.1 * sign), 0.01
    sight = start(estimate(q=hover(0.7), actuators=(500, 500, 0, 0)), A)._replace(attitude=hover(0.7))
    q_d = turned(hover(0.7), Vector(rate.x * dt, rate.y * dt, rate.z * dt))
    kept = decay(GAINS.turn_filter * dt)
    for either in (q_d, negated(q_d)):
        found = line_of_sight._turning(sight._replace(turning=NOTHING), either, GAINS, dt)
        assert found == pytest.approx([(1.0 - kept) * part for part in rate], rel=1e-3)
