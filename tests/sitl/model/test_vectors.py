"""Vectors against numpy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.model.vectors import Vector, add, add_scaled, cross, dot, level_norm, norm, scaled, shortened, subtract

VECTORS = st.builds(Vector, *[st.floats(-100.0, 100.0)] * 3)


@given(VECTORS, VECTORS, st.floats(-10.0, 10.0))
def test_sums_and_products_are_those_of_numpy(a, b, k):
    x, y = np.array(a), np.array(b)
    assert add(a, b) == tuple(x + y)
    assert subtract(a, b) == tuple(x - y)
    assert scaled(a, k) == tuple(k * x)
    assert add_scaled(a, b, k) == tuple(x + k * y)
    assert dot(a, b) == pytest.approx(x @ y, rel=1e-12, abs=1e-9)
    assert cross(a, b) == pytest.approx(np.cross(x, y), rel=1e-12, abs=1e-9)
    assert norm(a) == pytest.approx(np.linalg.norm(x))
    assert level_norm(a.x, b.y) == pytest.approx(np.hypot(a.x, b.y))


def test_a_vector_is_shortened_to_a_length_and_never_lengthened():
    assert shortened(Vector(3.0, 0.0, -4.0), 10.0) == Vector(3.0, 0.0, -4.0)
    assert shortened(Vector(3.0, 0.0, -4.0), 5.0) == Vector(3.0, 0.0, -4.0)
    assert shortened(Vector(3.0, 0.0, -4.0), 1.0) == pytest.approx((0.6, 0.0, -0.8))
    assert shortened(Vector(3.0, 0.0, -4.0), 0.0) == Vector(0.0, 0.0, -0.0)
    assert shortened(Vector(0.0, 0.0, 0.0), 1.0) == Vector(0.0, 0.0, 0.0)
