"""The straight wing against the arc."""

import pytest

from sitl.airframe import load
from sitl.model.hover_model import force_matrix, moment_matrix
from sitl.studies.reproduction import shapes

NOMINAL = load("nominal").parameters


def test_the_straight_wing_of_the_comparison_is_the_hover_model():
    F, M = shapes.input_matrices(NOMINAL, shapes.STRAIGHT)
    assert pytest.approx(force_matrix(NOMINAL)) == F
    assert pytest.approx(moment_matrix(NOMINAL)) == M


def test_the_arc_pushes_sideways_by_what_c_y0_lets_it():
    a = NOMINAL._replace(C_y0=0.2)
    F, M = shapes.input_matrices(a, shapes.ARC)
    assert F[1, 2:] == pytest.approx([a.S_ratio * a.C_y0 * a.xi_f] * 2)
    assert F[[0, 2]] == pytest.approx(force_matrix(a)[[0, 2]])
    assert M[2, 2:] == pytest.approx([-a.S_ratio * a.b / a.c * a.C_y0 * a.xi_m * a.Delta_r] * 2)
