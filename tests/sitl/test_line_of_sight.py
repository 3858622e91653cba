"""The line-of-sight law: the attitude of a force is that of the trims, and in a trim the law changes nothing."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.airframe import load
from sitl.design.forward import sight_gains
from sitl.design.trim import decelerating_trim, level_trim, turning_trim
from sitl.kernels.aerodynamics import wrench
from sitl.kernels.quaternion import from_euler, hover, rotate, rotate_inverse
from sitl.kernels.state import ACTUATOR, SIZE, P, Q, V, W
from sitl.laws import line_of_sight, moment_observer
from sitl.laws.line_of_sight import BRAKE, CRUISE, attitude, control, guarded
from sitl.laws.path import LEG, Path

A = load("nominal").parameters
GAINS = sight_gains()
STILL = np.zeros(3)
SPEEDS = np.arange(0.0, 20.1, 0.5)


def attitude_of(v_a, acceleration=(0.0, 0.0, 0.0), heading=0.0, last=None):
    force = A.m * np.add(acceleration, (0.0, 0.0, A.g))
    start = hover(heading) if last is None else last
    return attitude(force, np.array(v_a, dtype=float), heading, start, GAINS, A)


def between(q, other):
    """Angle between two attitudes [deg]; 360 where one is the other's negative."""
    return math.degrees(2.0 * math.acos(np.clip(q @ other, -1.0, 1.0)))


def northwards(speed, climb):
    return speed * np.array((math.cos(climb), 0.0, math.sin(climb)))


@pytest.mark.parametrize("climb", np.radians((-20.0, -10.0, 0.0, 10.0, 30.0, 45.0)))
def test_the_attitude_of_straight_flight_is_the_trims(climb):
    for speed in SPEEDS:
        trim = level_trim(A, speed, climb)
        q = from_euler(0.0, -trim.theta, 0.0)
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
    trim = turning_trim(A, speed, rate)
    q = attitude_of((speed, 0.0, 0.0), (0.0, speed * rate, 0.0), last=trim.q)
    assert between(q, trim.q) < 1.0
    y = rotate(q, np.array((0.0, 1.0, 0.0)))
    assert y[2] * rate < 0.0  # the left wing down into a left turn
    assert abs(y[0]) < 1e-9  # without sideslip


@given(azimuth=st.floats(-3.1, 3.1), speed=st.floats(8.0, 20.0), vertical=st.floats(-2.0, 2.0))
def test_the_attitude_turns_with_the_air_stream(azimuth, speed, vertical):
    """On the wing the heading it was told plays no part."""
    c, s = math.cos(azimuth), math.sin(azimuth)
    v_a = np.array((speed * c, speed * s, vertical))
    x = rotate(attitude_of(v_a, heading=azimuth + 0.3), np.array((1.0, 0.0, 0.0)))
    straight = rotate(attitude_of((speed, 0.0, vertical)), np.array((1.0, 0.0, 0.0)))
    assert x == pytest.approx((c * straight[0], s * straight[0], straight[2]), abs=1e-9)


@given(heading=st.floats(-3.1, 3.1), wind=st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)))
def test_without_airspeed_to_go_by_the_belly_points_where_it_is_told(heading, wind):
    q = attitude_of((*wind, 0.0), heading=heading)
    y = rotate(q, np.array((0.0, 1.0, 0.0)))
    assert y == pytest.approx((-math.sin(heading), math.cos(heading), 0.0), abs=1e-9)


@pytest.mark.parametrize("climb", [0.0, 0.2, -0.2])
@pytest.mark.parametrize("across", [0.0, 3.0, -3.0])
@pytest.mark.parametrize("heading", [0.0, 0.1])
def test_from_rest_to_cruise_the_attitude_never_jumps_nor_changes_its_sign(climb, across, heading):
    last = attitude_of(STILL, (0.0, across, 0.0), heading)
    for speed in np.arange(0.01, 20.0, 0.01):
        q = attitude_of(northwards(speed, climb), (0.0, across, 0.0), heading, last)
        assert between(q, last) < 0.25, speed
        last = q


def test_a_force_along_the_air_stream_keeps_the_span_it_had():
    q = from_euler(0.3, -1.2, 0.8)
    fall = attitude(np.array((0.0, 0.0, A.m * A.g)), np.array((0.0, 0.0, 12.0)), 0.0, q, GAINS, A)
    assert np.isfinite(fall).all()
    assert np.linalg.norm(fall) == pytest.approx(1.0)


def trimmed(speed):
    """A plant in level flight northwards, and its trim."""
    trim = level_trim(A, speed)
    plant = np.full(SIZE, np.nan)
    plant[P : P + 3], plant[V : V + 3], plant[W : W + 3] = (0.0, 0.0, 50.0), (speed, 0.0, 0.0), 0.0
    plant[Q : Q + 4] = from_euler(0.0, -trim.theta, 0.0)
    plant[ACTUATOR : ACTUATOR + 2], plant[ACTUATOR + 2 : ACTUATOR + 4] = trim.omega, trim.delta
    return plant, trim


def commanded(plant, path, phase=CRUISE, ticks=1):
    law, command = np.empty(line_of_sight.SIZE), np.empty(4)
    line_of_sight.reset(plant, law, A)
    for _ in range(ticks):
        control(plant, law, path, STILL, 0.0, phase, STILL, GAINS, A, 0.002, command)
    return command, law


def northward_leg(airspeed):
    ends = np.array((0.0, 0.0, 50.0)), np.array((500.0, 0.0, 50.0))
    return Path(LEG, *ends, 0.0, airspeed, stop=True, level=0.0, low=0.0)


@pytest.mark.parametrize("speed", [7.0, 10.0, 15.0, 20.0])
def test_in_a_trim_on_its_leg_it_commands_the_trim(speed):
    plant, trim = trimmed(speed)
    command, law = commanded(plant, northward_leg(speed), ticks=50)
    assert command == pytest.approx([trim.omega] * 2 + [trim.delta] * 2, rel=0.01)
    assert law[line_of_sight.WANTED : line_of_sight.WANTED + 3] == pytest.approx(STILL, abs=1e-6)


@pytest.mark.parametrize("phase", [CRUISE, BRAKE])
def test_what_it_wants_changes_no_faster_than_its_jerk(phase):
    plant, _ = trimmed(15.0)
    plant[P + 1], plant[P + 2] = 20.0, 40.0
    _, law = commanded(plant, northward_leg(8.0), phase, ticks=10)
    moved = np.linalg.norm(law[line_of_sight.WANTED : line_of_sight.WANTED + 3])
    assert 0.0 < moved <= GAINS.guidance.jerk * 0.002 * 10 + 1e-9


def test_a_dive_is_pulled_out_of_whatever_the_path_wants():
    wanted = np.array((1.0, 2.0, -3.0))
    assert guarded(np.array((12.0, 0.0, -3.0)), wanted) == pytest.approx(wanted)
    assert guarded(np.array((20.0, 0.0, -5.0)), wanted) == pytest.approx(wanted)  # fast, but not steep
    assert guarded(np.array((8.0, 0.0, -6.0)), wanted) == pytest.approx((0.0, 0.0, 8.0))


@settings(max_examples=20)
@given(rates=st.tuples(*[st.floats(-1.0, 1.0)] * 3), share=st.floats(0.2, 4.0))
def test_the_observer_finds_a_moment_that_the_model_does_not_know(rates, share):
    """A body whose rates stay as they are is held by what balances the model's moment: a lag of the bandwidth."""
    plant, _ = trimmed(12.0)
    plant[W : W + 3] = rates
    v_b, w = rotate_inverse(plant[Q : Q + 4], plant[V : V + 3]), plant[W : W + 3]
    J = np.array((A.J1, A.J2, A.J3))
    moment = np.array(wrench(*v_b, *w, *plant[ACTUATOR : ACTUATOR + 4], A)[3:])
    unknown = np.cross(w, J * w) - moment
    observer = np.empty(moment_observer.SIZE)
    moment_observer.reset(plant, observer, A)
    bandwidth, dt = 8.0, 1e-4
    for _ in range(round(share / bandwidth / dt) + 1):
        found = moment_observer.update(plant, STILL, observer, bandwidth, A, dt)
    assert found == pytest.approx(unknown * (1.0 - math.exp(-share)), abs=1e-3 * np.linalg.norm(unknown) + 1e-9)
