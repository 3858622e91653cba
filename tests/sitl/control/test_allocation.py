"""Allocation: commands within limits are met exactly; beyond them the right part is given up."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control.allocation import MOMENT, THRUST, YAW, Virtual, allocate
from sitl.model.aerodynamics import moment_matrix
from sitl.model.airframe_files import load

A = load("nominal").parameters
LOW, HIGH = A.k_f * A.omega_min**2, A.k_f * A.omega_max**2

thrusts = st.floats(-3.0, 12.0)
elevons = st.floats(-6.0, 6.0)


def allocated(*u):
    return allocate(Virtual(*u), A)


def virtual(command):
    T = A.k_f * np.square(command[:2])
    return np.concatenate((T, command[2:] * T))


@given(T1=st.floats(LOW, HIGH), T2=st.floats(LOW, HIGH), d1=st.floats(-0.5, 0.5), d2=st.floats(-0.5, 0.5))
def test_a_command_within_the_limits_is_met(T1, T2, d1, d2):
    u = (T1, T2, d1 * T1, d2 * T2)
    command, saturation = allocated(*u)
    assert virtual(command) == pytest.approx(np.array(u), abs=1e-9)
    assert saturation == 0


@given(T1=thrusts, T2=thrusts, n1=elevons, n2=elevons)
def test_no_command_leaves_the_limits(T1, T2, n1, n2):
    command, _ = allocated(T1, T2, n1, n2)
    assert min(command[:2]) >= A.omega_min - 1e-9
    assert max(command[:2]) <= A.omega_max + 1e-9
    assert max(map(abs, command[2:])) <= A.delta_max + 1e-12


@given(T1=thrusts, T2=thrusts)
def test_the_yaw_moment_outlives_the_thrust(T1, T2):
    command, saturation = allocated(T1, T2, 0.0, 0.0)
    T = virtual(command)[:2]
    wanted = min(max(T1 - T2, LOW - HIGH), HIGH - LOW)
    assert T[0] - T[1] == pytest.approx(wanted, abs=1e-9)
    assert bool(saturation & YAW) == (abs(T1 - T2) > HIGH - LOW + 1e-9)
    assert bool(saturation & THRUST) == (abs(T.sum() - T1 - T2) > 1e-9)


@given(n1=elevons, n2=elevons)
def test_a_moment_too_large_keeps_its_direction(n1, n2):
    command, saturation = allocated(2.4, 2.4, n1, n2)
    wanted = moment_matrix(A) @ (0.0, 0.0, n1, n2)
    got = moment_matrix(A) @ (0.0, 0.0, *virtual(command)[2:])
    assert np.cross(got, wanted) == pytest.approx(np.zeros(3), abs=1e-9)
    assert got @ wanted >= 0.0
    assert bool(saturation & MOMENT) == (max(abs(n1), abs(n2)) > 2.4 * A.delta_max)
    if saturation:
        assert max(map(abs, command[2:])) == pytest.approx(A.delta_max)


def test_deflections_are_those_of_the_thrust_that_is_given_not_of_the_one_asked_for():
    command, saturation = allocated(0.0, 0.0, 0.05, 0.05)
    assert command[2:] == pytest.approx([0.05 / LOW] * 2)
    assert saturation == THRUST
    assert math.isclose(command.left_motor, A.omega_min)


def test_where_no_inflow_is_told_the_air_stands_still():
    a, u = load("collage").parameters, Virtual(2.0, 2.2, 0.1, -0.1)
    assert allocate(u, a) == allocate(u, a, 0.0)
    assert allocate(u, a) != allocate(u, a, 1.0)
