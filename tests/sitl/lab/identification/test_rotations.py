"""Rotations by the row agree with the vehicle's own quaternions."""

import numpy as np
import pytest

from sitl.lab.identification import rotations
from sitl.model import quaternions
from sitl.model.vectors import Vector

Q = rotations.unit(np.random.default_rng(1).standard_normal((50, 4)))
P = rotations.unit(np.random.default_rng(2).standard_normal((50, 4)))


def test_products_and_matrices_are_those_of_the_model():
    for p, q, product, matrix in zip(P, Q, rotations.product(P, Q), rotations.matrices(Q), strict=True):
        assert product == pytest.approx(quaternions.multiply(quaternions.Quaternion(*p), quaternions.Quaternion(*q)))
        turned = quaternions.rotate(quaternions.Quaternion(*q), Vector(1.0, -2.0, 3.0))
        assert matrix @ [1.0, -2.0, 3.0] == pytest.approx(turned)


def test_vectors_come_back_the_shorter_way_round():
    phi = np.random.default_rng(3).standard_normal((50, 3))
    phi *= np.random.default_rng(4).uniform(0.0, 3.1, 50)[:, None] / np.linalg.norm(phi, axis=1)[:, None]
    phi[0] = 0.0
    assert rotations.vector_of(-rotations.of_vector(phi)) == pytest.approx(phi, abs=1e-12)


def test_what_lies_between_does_not_depend_on_signs():
    turning = rotations.of_vector(np.outer(np.linspace(0.0, 1.0, 11), [0.0, 0.3, 0.4]))
    flipped = turning * np.where(np.arange(11) % 3 == 0, -1.0, 1.0)[:, None]
    time = np.linspace(0.0, 1.0, 11)
    between = rotations.interpolated(np.array([0.25]), time, flipped)
    assert rotations.vector_of(between)[0] == pytest.approx([0.0, 0.075, 0.1], abs=1e-6)
