"""Attitudes: the frames' signs, and the algebra."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.model.quaternions import (
    conjugate,
    from_euler,
    hover,
    multiply,
    rotate,
    rotate_inverse,
    small_rotation,
    x_axis,
    z_axis,
)
from sitl.model.vectors import Vector
from tests.support.flights.estimates import rotation

X, Z = Vector(1.0, 0.0, 0.0), Vector(0.0, 0.0, 1.0)
vectors = st.builds(Vector, *[st.floats(-20, 20)] * 3)
phis = st.builds(Vector, *[st.floats(-3, 3)] * 3)
headings = st.floats(-math.pi, math.pi)


@given(headings)
def test_hover_points_the_nose_up_at_any_heading(heading):
    q = hover(heading)
    assert rotate(q, X) == pytest.approx((0, 0, 1), abs=1e-12)
    belly = Vector(0.0, 0.0, -1.0)
    assert rotate(q, belly) == pytest.approx((math.cos(heading), math.sin(heading), 0), abs=1e-12)
    assert q == pytest.approx(from_euler(0.0, -0.5 * math.pi, heading), abs=1e-15)


def test_nose_up_is_a_negative_rotation_about_y():
    assert rotate(from_euler(0.0, -0.3, 0.0), X) == pytest.approx((math.cos(0.3), 0.0, math.sin(0.3)))


@given(vectors, phis)
def test_rotating_back_gives_the_vector_again(v, phi):
    q = rotation(phi)
    assert rotate_inverse(q, rotate(q, v)) == pytest.approx(v, abs=1e-9)


@given(vectors, phis, phis)
def test_a_product_rotates_by_one_after_the_other(v, first, second):
    p, q = rotation(first), rotation(second)
    assert rotate(multiply(p, q), v) == pytest.approx(rotate(p, rotate(q, v)), abs=1e-9)
    assert multiply(q, conjugate(q)) == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-12)


@given(phis)
def test_the_axes_are_rotated_unit_vectors(phi):
    q = rotation(phi)
    assert x_axis(q) == pytest.approx(rotate(q, X), abs=1e-12)
    assert z_axis(q) == pytest.approx(rotate(q, Z), abs=1e-12)


@given(phis, st.floats(1e-9, 0.3))
def test_a_small_rotation_is_the_exponential_map(phi, angle):
    size = math.sqrt(sum(x * x for x in phi))
    small = Vector(*(angle * x / size if size else 0.0 for x in phi))
    assert small_rotation(small) == pytest.approx(rotation(small), abs=3e-16)


@given(st.builds(Vector, *[st.floats(-1e3, 1e3)] * 3))
def test_a_large_rotation_is_a_unit_quaternion_still(phi):
    assert np.linalg.norm(small_rotation(phi)) == pytest.approx(1.0, abs=1e-12)
