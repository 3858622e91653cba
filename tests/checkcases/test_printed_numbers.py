"""The report's printed numbers: as it got them, slips included, and beside them the corrected values."""

import math

import numpy as np
import pytest

from sitl.design import linearise
from sitl.design.lqr import lqr
from sitl.design.trim import level_trim
from sitl.lab.reproduction.equations.as_typed import (
    DIGIT,
    PRINTED_A,
    PRINTED_B,
    PRINTED_GAIN,
    PRINTED_INVERSE,
    PRINTED_START,
    forward_matrices,
    typed_hover_linearisation,
    typed_moment_matrix,
    typed_trim,
)
from sitl.model.aerodynamics import moment_matrix
from sitl.model.airframe_files import load
from sitl.model.quaternions import Quaternion, from_euler, x_axis

PUBLISHED, NOMINAL = load("published").parameters, load("nominal").parameters


def test_the_moment_pseudo_inverse_is_the_printed_one():
    """All twelve entries; the last is printed 1.49 for 1.496."""
    M = moment_matrix(PUBLISHED)
    M[2] = typed_moment_matrix(PUBLISHED)[2]
    assert np.linalg.pinv(M) == pytest.approx(PRINTED_INVERSE, abs=0.0075)


def test_the_nominal_set_keeps_the_printed_pseudo_inverse():
    """The set for flying changes the forward flight, not the hover: within 1 % (its yaw arm loses the drag)."""
    ours, printed = np.linalg.pinv(moment_matrix(NOMINAL)), [[-4.51, -27.75], [4.51, -27.75]]
    assert ours[2:, :2] == pytest.approx(np.array(printed), rel=0.002)
    assert ours[1, 2] == pytest.approx(3.23, rel=0.01)


def test_the_lqr_gain_is_printed_from_an_unconstrained_quaternion_and_a_typed_roll_term():
    A, B = typed_hover_linearisation(PUBLISHED)
    K, _ = lqr(A, B, np.eye(12), np.eye(4))
    assert np.abs(K - np.delete(PRINTED_GAIN, 6, axis=1)).max() < DIGIT
    assert not PRINTED_GAIN[:, 6].any()


def test_the_lqr_gain_done_right_differs_in_roll_yaw_and_pitch():
    K, _ = lqr(*linearise.hover(NOMINAL), np.eye(12), np.eye(4))
    left = [0, -0.70, 0.707, 0, -1.031, 0.922, 5.754, 0, -5.612, 0.10, 0, -0.805]
    elevon = [-0.707, -0.10, 0, -1.126, -0.152, 0, 0.414, -15.06, -1.404, -0.716, -1.407, -0.144]
    assert K[0] == pytest.approx(np.array(left), abs=0.02)
    assert K[2] == pytest.approx(np.array(elevon), abs=0.02)


def test_the_spurious_entry_of_a_vanishes_under_the_unit_constraint():
    """dv_z/deps_2, printed as -sqrt2 g, is zero on the unit sphere: the thrust's height is stationary in tilt."""
    A, _ = linearise.hover(PUBLISHED)
    assert A[5, 7] == 0.0
    assert A[3, 7] == pytest.approx(2.0 * math.sqrt(2.0) * PUBLISHED.g)


def test_the_forward_point_is_printed_through_a_unit_slip():
    theta, thrust, product = typed_trim(PUBLISHED)
    assert math.degrees(theta) == pytest.approx(62.67, abs=0.02)
    assert (thrust, product) == pytest.approx((2.18, 0.92), abs=DIGIT)


def test_the_forward_point_done_right():
    """The nominal set flies level at 5 m/s with the elevons close to their limit."""
    trim = level_trim(NOMINAL, 5.0)
    assert math.degrees(trim.theta) == pytest.approx(62.9, abs=0.1)
    assert trim.thrust == pytest.approx(2.17, abs=0.01)
    assert math.degrees(trim.delta) == pytest.approx(26.8, abs=0.1)
    assert trim.exists


def test_a_of_the_forward_point_is_the_printed_one():
    """All hundred entries. A[v_y, w] is the force from the rates, A[eps_2, eps_2] Simulink's quaternion term."""
    A, _ = forward_matrices(PUBLISHED)
    assert np.abs(A - PRINTED_A).max() < DIGIT


def test_the_damping_block_done_right_still_has_a_yaw_that_drives_itself():
    """B on both sides and deflections for D leave -0.88 of the pitch's -7.77.

    What drives the yaw is no slip: it is C_np under the elevons' Delta_m, which at 27 deg outweighs C_nr.
    """
    A, _ = linearise.forward(NOMINAL, level_trim(NOMINAL, 5.0))
    assert A[7:, 7:] == pytest.approx(np.array([[-1.79, 0, 0.48], [0, -0.88, 0], [-0.48, 0, 0.33]]), abs=0.01)


def test_b_of_the_forward_point_is_the_printed_one():
    _, B = forward_matrices(PUBLISHED)
    assert np.abs(B - PRINTED_B).max() < DIGIT


def test_the_published_set_has_no_level_trim_in_the_corridor():
    for speed in (5.5, 7.0, 9.0):
        assert not level_trim(PUBLISHED, speed).exists
    assert math.degrees(level_trim(PUBLISHED, 7.0).delta) == pytest.approx(35.8, abs=0.3)
    for inside, outside in ((5.05, 5.08), (9.36, 9.33)):
        assert level_trim(PUBLISHED, inside).exists
        assert not level_trim(PUBLISHED, outside).exists
    for speed in (4.5, 10.0, 15.0):
        assert level_trim(PUBLISHED, speed).exists


@pytest.mark.parametrize(
    ("speed", "theta", "thrust", "delta", "omega"),
    [
        (0.0, 90.0, 2.425, 0.0, 687),
        (2.0, 85.3, 2.417, 7.0, 686),
        (4.0, 71.9, 2.310, 22.3, 671),
        (5.5, 58.2, 2.077, 27.4, 636),
        (8.0, 37.4, 1.508, 21.6, 542),
        (10.0, 26.0, 1.122, 15.5, 468),
        (15.0, 12.3, 0.643, 7.4, 354),
        (20.0, 7.0, 0.523, 4.2, 319),
        (25.0, 4.5, 0.546, 2.7, 326),
    ],
)
def test_the_nominal_set_trims_at_every_speed(speed, theta, thrust, delta, omega):
    trim = level_trim(NOMINAL, speed)
    assert math.degrees(trim.theta) == pytest.approx(theta, abs=0.1)
    assert trim.thrust == pytest.approx(thrust, abs=0.003)
    assert math.degrees(trim.delta) == pytest.approx(delta, abs=0.1)
    assert trim.omega == pytest.approx(omega, abs=1.0)
    assert trim.exists


def test_the_printed_initial_quaternion_is_no_zyx_of_its_angles():
    """Roll 10, pitch -45, yaw 25 deg; the printed one even points the nose down in this frame."""
    ours = from_euler(math.radians(10.0), math.radians(-45.0), math.radians(25.0))
    assert ours == pytest.approx([0.891, 0.161, -0.355, 0.232], abs=0.001)
    assert x_axis(Quaternion(*PRINTED_START)).z < 0.0 < x_axis(ours).z


def test_the_literal_table_cannot_fly_forward():
    table = load("report-table").parameters
    assert not any(level_trim(table, speed).exists for speed in (5.0, 10.0, 15.0))
