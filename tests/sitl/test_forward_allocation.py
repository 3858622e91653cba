"""Allocation in an air stream: the model inverted exactly within the limits, given up in order beyond them."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sitl.airframe import load
from sitl.design.trim import level_trim
from sitl.kernels.aerodynamics import damping, wrench
from sitl.laws.allocation import BOOST, PITCH, ROLL, THRUST, YAW
from sitl.laws.forward_allocation import ROLL_SHARE, invert, thrusts_of

A = load("nominal").parameters
LOWEST, HIGHEST = A.k_f * A.omega_min**2, A.k_f * A.omega_max**2  # thrust of a propeller [N]
SOME = np.array((2.0, 2.0))  # thrusts [N]
AT_REST = np.zeros(3)

rates = st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(np.array)
velocities = st.tuples(st.floats(0.0, 20.0), st.floats(-4.0, 4.0), st.floats(-8.0, 4.0)).map(np.array)
moments = st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(np.array)
thrusts = st.tuples(*[st.floats(LOWEST, HIGHEST)] * 2).map(np.array)
forces = st.floats(-5.0, 25.0)


def inverted(force, moment, v=AT_REST, w=AT_REST, now=SOME):
    command = np.empty(4)
    flags = invert(force, np.array(moment, dtype=float), v, w, now, A, command)
    return command, flags


def settled(force, moment, v, w):
    """The commands once the thrusts are those commanded, the flags of the last, and the thrusts' change in it."""
    now = SOME
    for _ in range(30):
        command, flags = inverted(force, moment, v, w, now)
        before, now = now, thrusts_of(command[:2], A)
    return command, flags, np.abs(now - before).max()


def test_nothing_is_asked_of_a_trim_beyond_the_trim():
    for speed in np.arange(0.0, 20.1, 1.0):
        trim = level_trim(A, speed)
        v = speed * np.array((math.cos(trim.theta), 0.0, -math.sin(trim.theta)))
        command, flags, _ = settled(A.m * A.g * math.sin(trim.theta), AT_REST, v, AT_REST)
        assert command[:2] == pytest.approx([trim.omega] * 2, rel=0.01)
        assert command[2:] == pytest.approx([trim.delta] * 2, rel=0.01, abs=1e-9)
        assert flags & ~BOOST == 0


def left_out(command, v, w):
    """What the inversion leaves out of Fx, Mx, My, Mz: the deflected elevons' own drag and damping."""
    both, differ = command[2] + command[3], command[2] - command[3]
    h = 0.5 * A.rho * A.S * math.sqrt(v @ v + A.mu * A.c**2 * (w @ w))
    more = np.subtract(damping(*w, both, h, A), damping(*w, 0.0, h, A))
    drag = 0.5 * h * A.C_d0 * A.xi_f * v[2]
    return np.array((drag * both, more[0], more[1], more[2] - A.a_y * drag * differ))


@given(
    force=st.floats(3.0, 12.0), roll=st.floats(-0.15, 0.15), pitch=st.floats(-0.02, 0.02), yaw=st.floats(-0.2, 0.2),
    forward=st.floats(0.0, 20.0), side=st.floats(-4.0, 4.0), belly=st.floats(-0.5, 0.5), w=rates,
)  # fmt: skip
def test_what_is_not_given_up_is_what_the_model_gives(force, roll, pitch, yaw, forward, side, belly, w):
    v = np.array((forward, side, belly))
    command, flags, moved = settled(force, (roll, pitch, yaw), v, w)
    assume(flags == 0 and moved < 1e-12)
    Fx, _, _, Mx, My, Mz = wrench(*v, *w, *command, A)
    got = np.array((Fx, Mx, My, Mz)) - left_out(command, v, w)
    assert got == pytest.approx((force, roll, pitch, yaw), abs=1e-8)


@given(force=st.floats(3.0, 12.0), pitch=st.floats(-0.02, 0.02), yaw=st.floats(-0.2, 0.2), forward=st.floats(0.0, 20.0))
def test_what_the_inversion_leaves_out_is_small(force, pitch, yaw, forward):
    v = np.array((forward, 0.0, -1.0))
    command, flags, moved = settled(force, (0.0, pitch, yaw), v, AT_REST)
    assume(flags == 0 and moved < 1e-12)
    assert np.abs(left_out(command, v, AT_REST)).max() < 0.05


@given(force=forces, moment=moments, v=velocities, w=rates, now=thrusts)
def test_no_command_leaves_the_limits(force, moment, v, w, now):
    command, _ = inverted(force, moment, v, w, now)
    assert (command[:2] >= A.omega_min - 1e-9).all()
    assert (command[:2] <= A.omega_max + 1e-9).all()
    assert np.abs(command[2:]).max() <= A.delta_max + 1e-12


@given(force=forces, moment=moments, v=velocities, now=thrusts)
def test_yaw_outlives_the_thrust_and_both_say_when_they_give_way(force, moment, v, now):
    command, flags = inverted(force, moment, v, AT_REST, now)
    T = thrusts_of(command[:2], A)
    asked = -moment[2] / (A.p_y - A.S_ratio * A.a_y * A.C_d0)
    assert T[0] - T[1] == pytest.approx(min(max(asked, LOWEST - HIGHEST), HIGHEST - LOWEST), abs=1e-9)
    assert bool(flags & YAW) == (abs(asked) > HIGHEST - LOWEST + 1e-9)


def test_thrust_beyond_the_motors_is_said_and_less_than_idle_is_not():
    command, flags = inverted(30.0, AT_REST)
    assert flags == THRUST
    assert command[:2] == pytest.approx([A.omega_max] * 2)
    command, flags = inverted(-5.0, AT_REST, np.array((15.0, 0.0, 0.0)))
    assert flags == 0
    assert command[:2] == pytest.approx([A.omega_min] * 2)


@given(roll=st.floats(-3.0, 3.0), pitch=st.floats(-0.5, 0.5), v=st.floats(0.0, 20.0))
def test_pitch_is_kept_before_roll_and_roll_keeps_its_share(roll, pitch, v):
    """The elevons of equal slipstreams: pitch is their mean, roll half their difference."""
    command, flags = inverted(5.0, (roll, pitch, 0.0), np.array((v, 0.0, 0.0)))
    mean, difference = 0.5 * (command[2] + command[3]), 0.5 * (command[2] - command[3])
    big, _ = inverted(5.0, (0.0, pitch, 0.0), np.array((v, 0.0, 0.0)))
    wanted = 0.5 * (big[2] + big[3])  # pitch alone
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
    effect = A.C_l * A.xi_f * (A.S_ratio * SOME.sum() + h * v)
    return -pitch / (A.Delta_r * A.xi_m / A.xi_f) / effect


def test_pitch_beyond_the_elevons_raises_the_thrust_until_they_can():
    """In the corridor, motors at idle: more slipstream is the only way to raise the nose."""
    v, moment = np.array((4.0, 0.0, -3.0)), np.array((0.0, -0.02, 0.0))
    asked = 1.0
    command, flags, moved = settled(asked, moment, v, AT_REST)
    assert flags == BOOST
    assert moved < 1e-9
    assert thrusts_of(command[:2], A).sum() > 2.0 * asked
    assert wrench(*v, *AT_REST, *command, A)[4] == pytest.approx(moment[1], abs=1e-3)
    assert command[2] < A.delta_max


def test_a_pitch_within_the_elevons_leaves_the_thrust_alone():
    command, flags, _ = settled(5.0, (0.0, -0.01, 0.0), np.array((12.0, 0.0, -1.0)), AT_REST)
    assert flags == 0
    drag = 0.5 * A.rho * A.S * math.hypot(12.0, 1.0) * A.C_d0 * 12.0
    assert thrusts_of(command[:2], A).sum() * (1.0 - A.S_ratio * A.C_d0) == pytest.approx(5.0 + drag)


def test_compiled_equals_python():
    arguments = (4.0, np.array((0.3, -0.05, 0.2)), np.array((9.0, 1.0, -3.0)), np.array((0.3, -0.2, 0.1)), SOME, A)
    compiled, python = np.empty(4), np.empty(4)
    assert invert(*arguments, compiled) == getattr(invert, "py_func", invert)(*arguments, python)
    assert compiled == pytest.approx(python, rel=1e-12)


def test_moderate_demands_in_cruise_give_nothing_up():
    """So that the test above does test something."""
    for speed in (6.0, 10.0, 15.0, 20.0):
        trim = level_trim(A, speed)
        v = speed * np.array((math.cos(trim.theta), 0.0, -math.sin(trim.theta)))
        for moment in np.vstack((np.eye(3), -np.eye(3))) * (0.05, 0.005, 0.05):
            _, flags, moved = settled(A.m * A.g * math.sin(trim.theta), moment, v, AT_REST)
            assert flags & ~BOOST == 0, (speed, moment)
            assert moved < 1e-9
