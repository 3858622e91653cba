"""The straight wing against the arc."""

import pytest

from sitl.lab.reproduction.experiments import wing_shapes
from sitl.model.aerodynamics import force_matrix, moment_matrix
from sitl.model.airframe_files import load

NOMINAL = load("nominal").parameters


def test_the_straight_wing_of_the_comparison_is_the_hover_model():
    F, M = wing_shapes.input_matrices(NOMINAL, wing_shapes.STRAIGHT_HINGE)
    assert pytest.approx(force_matrix(NOMINAL)) == F
    assert pytest.approx(moment_matrix(NOMINAL)) == M


def test_the_arc_pushes_sideways_in_proportion_to_c_y0():
    a = NOMINAL._replace(C_y0=0.2)
    F, M = wing_shapes.input_matrices(a, wing_shapes.ARC_HINGE)
    assert F[1, 2:] == pytest.approx([a.S_ratio * a.C_y0 * a.xi_f] * 2)
    assert F[[0, 2]] == pytest.approx(force_matrix(a)[[0, 2]])
    assert M[2, 2:] == pytest.approx([-a.S_ratio * a.b / a.c * a.C_y0 * a.xi_m * a.Delta_r] * 2)
