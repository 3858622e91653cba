"""The kernel with the report's slips: without any it is the kernel, with all it gives the printed matrices."""

import math

import numpy as np
import pytest

from sitl.design import linearise
from sitl.design.trim import level_trim
from sitl.lab.reproduction.equations.as_typed import (
    A_SLIPS,
    ALL_SLIPS,
    B_SLIPS,
    PRINTED_A,
    PRINTED_B,
    forward_matrices,
    kernel_wrench,
    steady_climb,
    typed_force_matrix,
    typed_forces,
    typed_hover_linearisation,
    typed_moment_matrix,
    typed_trim,
)
from sitl.lab.reproduction.experiments.printed_numbers import agreeing
from sitl.model.aerodynamics import force_matrix, moment_matrix
from sitl.model.airframe_files import load

PUBLISHED = load("published").parameters
NONE = frozenset()


def test_without_slips_the_forces_are_the_kernel_s():
    draw = np.random.default_rng(1)
    for _ in range(50):
        v, w, T, D = draw.normal(size=3) * 8.0, draw.normal(size=3), draw.uniform(0.3, 5.0, 2), draw.normal(size=2)
        for ours, kernel in zip(
            typed_forces(v, w, T, D, PUBLISHED, NONE), kernel_wrench(v, w, T, D, PUBLISHED), strict=True
        ):
            assert ours == pytest.approx(kernel, abs=1e-12)


def test_without_slips_the_linear_models_are_those_of_the_design():
    trim = level_trim(PUBLISHED, 5.0)
    for ours, design in zip(forward_matrices(PUBLISHED, NONE), linearise.forward(PUBLISHED, trim), strict=True):
        assert ours == pytest.approx(design, abs=1e-7)
    for ours, design in zip(typed_hover_linearisation(PUBLISHED, NONE), linearise.hover(PUBLISHED), strict=True):
        assert ours == pytest.approx(design, abs=1e-4)
    assert typed_force_matrix(PUBLISHED) == pytest.approx(force_matrix(PUBLISHED), abs=1e-12)
    assert typed_moment_matrix(PUBLISHED, NONE) == pytest.approx(moment_matrix(PUBLISHED), abs=1e-12)


def test_without_slips_the_trim_is_the_design_s():
    theta, thrust, deflection = typed_trim(PUBLISHED, NONE)
    trim = level_trim(PUBLISHED, 5.0)
    assert (theta, thrust, deflection) == pytest.approx((trim.theta, trim.thrust, trim.delta), abs=1e-8)
    climb = level_trim(PUBLISHED, 20.0, math.radians(45.0))
    along_the_nose = 20.0 * math.cos(climb.theta - climb.climb)
    assert steady_climb(PUBLISHED, along_the_nose, climb.climb) == pytest.approx((climb.theta, climb.omega), rel=1e-6)


@pytest.mark.parametrize(("slips", "which", "digits"), [(A_SLIPS, 0, PRINTED_A), (B_SLIPS, 1, PRINTED_B)])
def test_the_printed_matrices_need_every_one_of_their_slips(slips, which, digits):
    assert agreeing(forward_matrices(PUBLISHED, slips)[which], digits) == digits.size
    for slip in slips:
        assert agreeing(forward_matrices(PUBLISHED, slips - {slip})[which], digits) < digits.size


@pytest.mark.parametrize("name", ["C_lp", "C_lr", "C_mq", "C_np"])
def test_a_kernel_without_a_damping_coefficient_no_longer_gives_the_printed_a(name):
    A, _ = forward_matrices(PUBLISHED._replace(**{name: 0.0}))
    assert agreeing(A, PRINTED_A) < 100.0


def test_the_area_of_the_free_stream_is_fixed_by_the_digits():
    """1.15 to four digits: 0.02 % more or less, and entries change their last digit."""
    for share, fits in ((0.9998, False), (1.0, True), (1.0002, False)):
        A, B = forward_matrices(PUBLISHED._replace(S=share * PUBLISHED.S), ALL_SLIPS)
        assert (agreeing(A, PRINTED_A) + agreeing(B, PRINTED_B) == 140.0) is fits
