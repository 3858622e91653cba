"""Allocation in an air stream: the model inverted exactly within the limits, given up in order beyond them."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sitl.control.allocation import BOOST, PITCH, ROLL, THRUST, YAW
from sitl.control.forward_flight.forward_allocation import ROLL_SHARE, ModelPoint, invert
from sitl.design.trim import level_trim
from sitl.model.aerodynamics import slopes, thrusts, wrench
from sitl.model.airframe_files import load
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, scaled

A = load("nominal").parameters
MIN_THRUST, MAX_THRUST = A.k_f * A.omega_min**2, A.k_f * A.omega_max**2  # of a propeller [N]
NOTHING = Vector(0.0, 0.0, 0.0)


def giving(left, right):
    """Actuators whose motors give these thrusts [N]."""
    return Actuators(math.sqrt(left / A.k_f), math.sqrt(right / A.k_f), 0.0, 0.0)


def thrusts_of(actuators):
    return np.array((A.k_f * actuators.left_motor**2, A.k_f * actuators.right_motor**2))


SOME = giving(2.0, 2.0)
rates = st.builds(Vector, *[st.floats(-2.0, 2.0)] * 3)
velocities = st.builds(Vector, st.floats(0.0, 20.0), st.floats(-4.0, 4.0), st.floats(-8.0, 4.0))
moments = st.builds(Vector, *[st.floats(-2.0, 2.0)] * 3)
motors = st.builds(giving, *[st.floats(MIN_THRUST, MAX_THRUST)] * 2)
forces = st.floats(-5.0, 25.0)


def inverted(force, moment, v=NOTHING, w=NOTHING, now=SOME):
    T1, T2 = thrusts(now, v.x, A)
    return invert(force, Vector(*moment), ModelPoint(*wrench(v, w, now, A), slopes(v, T1, T2, A), v.x, now), A)


def settled(force, moment, v, w):
    """The commands once the thrusts are those commanded, the flags of the last, and the thrusts' change in it."""
    now = SOME
    for _ in range(30):
        command, flags = inverted(force, moment, v, w, now)
        moved = np.abs(thrusts_of(command) - thrusts_of(now)).max()
        now = command
    return command, flags, moved


def in_trim(speed):
    """Level flight: its trim and its velocity in the body frame."""
    trim = level_trim(A, speed)
    return trim, Vector(speed * math.cos(trim.theta), 0.0, -speed * math.sin(trim.theta))


def test_nothing_is_asked_of_a_trim_beyond_the_trim():
    for speed in range(21):
        trim, v = in_trim(float(speed))
        command, flags, _ = settled(A.m * A.g * math.sin(trim.theta), NOTHING, v, NOTHING)
        assert command[:2] == pytest.approx([trim.omega] * 2, rel=0.01)
        assert command[2:] == pytest.approx([trim.delta] * 2, rel=0.01, abs=1e-9)
        assert flags & ~BOOST == 0


@given(
    force=st.floats(3.0, 12.0), roll=st.floats(-0.15, 0.15), pitch=st.floats(-0.02, 0.02), yaw=st.floats(-0.2, 0.2),
    forward=st.floats(0.0, 20.0), side=st.floats(-4.0, 4.0), belly=st.floats(-0.5, 0.5), w=rates,
)  # fmt: skip
def test_what_is_not_given_up_is_what_the_model_gives(force, roll, pitch, yaw, forward, side, belly, w):
    v = Vector(forward, side, belly)
    command, flags, moved = settled(force, (roll, pitch, yaw), v, w)
    assume(flags == 0 and moved < 1e-12)
    F, M = wrench(v, w, command, A)
    assert (F.x, *M) == pytest.approx((force, roll, pitch, yaw), abs=1e-8)


@given(force=forces, moment=moments, v=velocities, w=rates, now=motors)
def test_no_command_leaves_the_limits(force, moment, v, w, now):
    command, _ = inverted(force, moment, v, w, now)
    assert min(command[:2]) >= A.omega_min - 1e-9
    assert max(command[:2]) <= A.omega_max + 1e-9
    assert max(abs(command.left_elevon), abs(command.right_elevon)) <= A.delta_max


@given(force=forces, moment=moments, v=velocities, now=motors)
def test_yaw_outlives_the_thrust_and_both_say_when_they_give_way(force, moment, v, now):
    command, flags = inverted(force, moment, v, NOTHING, now)
    left, right = thrusts_of(command)
    asked = -moment.z / (A.p_y - A.S_ratio * A.a_y * A.C_d0)
    assert left - right == pytest.approx(min(max(asked, MIN_THRUST - MAX_THRUST), MAX_THRUST - MIN_THRUST), abs=1e-9)
    assert bool(flags & YAW) == (abs(asked) > MAX_THRUST - MIN_THRUST + 1e-9)


def test_thrust_beyond_the_motors_is_reported_and_less_than_idle_is_not():
    command, flags = inverted(30.0, NOTHING)
    assert flags == THRUST
    assert command[:2] == pytest.approx([A.omega_max] * 2)
    command, flags = inverted(-5.0, NOTHING, Vector(15.0, 0.0, 0.0))
    assert flags == 0
    assert command[:2] == pytest.approx([A.omega_min] * 2)


@given(roll=st.floats(-3.0, 3.0), pitch=st.floats(-0.5, 0.5), v=st.floats(0.0, 20.0))
def test_pitch_is_kept_before_roll_and_roll_keeps_its_share(roll, pitch, v):
    """The elevons of equal slipstreams: pitch is their mean, roll half their difference."""
    command, flags = inverted(5.0, (roll, pitch, 0.0), Vector(v, 0.0, 0.0))
    mean = 0.5 * (command.left_elevon + command.right_elevon)
    difference = 0.5 * (command.left_elevon - command.right_elevon)
    alone, _ = inverted(5.0, (0.0, pitch, 0.0), Vector(v, 0.0, 0.0))
    wanted = 0.5 * (alone.left_elevon + alone.right_elevon)
    share = ROLL_SHARE * A.delta_max
    assert abs(mean) >= min(abs(wanted), A.delta_max - share) - 1e-9
    if flags & ROLL:
        assert abs(difference) >= min(share, A.delta_max - abs(mean)) - 1e-9
        assert abs(mean) + abs(difference) == pytest.approx(A.delta_max)  # not a degree is left unused
        assert difference * roll < 0.0
    assert bool(flags & PITCH) == (abs(mean) < abs(_unlimited(pitch, v)) - 1e-9)


def _unlimited(pitch, v):
    """The symmetric deflection that pitch would take without limits, at the thrusts of now."""
    h = 0.5 * A.rho * A.S * v
    effect = A.C_l * A.xi_f * (A.S_ratio * thrusts_of(SOME).sum() + h * v)
    return -pitch / (A.Delta_r * A.xi_m / A.xi_f) / effect


def test_pitch_beyond_the_elevons_raises_the_thrust_until_they_can():
    """In the corridor, motors at idle: more slipstream is the only way to raise the nose."""
    v, pitch, asked = Vector(4.0, 0.0, -3.0), -0.02, 1.0
    command, flags, moved = settled(asked, (0.0, pitch, 0.0), v, NOTHING)
    assert flags == BOOST
    assert moved < 1e-9
    assert thrusts_of(command).sum() > 2.0 * asked
    assert wrench(v, NOTHING, command, A)[1].y == pytest.approx(pitch, abs=1e-3)
    assert command.left_elevon < A.delta_max


def test_a_pitch_within_the_elevons_leaves_the_thrust_alone():
    command, flags, _ = settled(5.0, (0.0, -0.01, 0.0), Vector(12.0, 0.0, -1.0), NOTHING)
    assert flags == 0
    drag = 0.5 * A.rho * A.S * math.hypot(12.0, 1.0) * A.C_d0 * 12.0
    assert thrusts_of(command).sum() * (1.0 - A.S_ratio * A.C_d0) == pytest.approx(5.0 + drag, abs=0.01)


def test_moderate_demands_in_cruise_give_nothing_up():
    """So that the test above does test something."""
    for speed in (6.0, 10.0, 15.0, 20.0):
        trim, v = in_trim(speed)
        for moment in (Vector(0.05, 0.0, 0.0), Vector(0.0, 0.005, 0.0), Vector(0.0, 0.0, 0.05)):
            for sign in (1.0, -1.0):
                _, flags, moved = settled(A.m * A.g * math.sin(trim.theta), scaled(moment, sign), v, NOTHING)
                assert flags & ~BOOST == 0, (speed, moment)
                assert moved < 1e-9
