"""Linear algebra without BLAS, against LAPACK."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from sitl.design.matrices import is_positive, product, riccati, solve, symmetric, transposed
from sitl.errors import SitlError

RANDOM = np.random.default_rng(1)


@pytest.mark.parametrize("shapes", [((3, 4), (4, 2)), ((5, 3, 3), (3, 1)), ((2, 3), (6, 3, 4)), ((4, 1, 2), (4, 2, 3))])
def test_a_product_is_the_product_of_each(shapes):
    A, B = (RANDOM.standard_normal(shape) for shape in shapes)
    assert product(A, B) == pytest.approx(A @ B, rel=1e-13, abs=1e-13)


@pytest.mark.parametrize("shapes", [((4, 4), (4, 2)), ((7, 5, 5), (5, 5)), ((6, 6), (3, 6, 1)), ((2, 3, 3), (2, 3, 2))])
def test_a_solution_solves_each(shapes):
    A, B = (RANDOM.standard_normal(shape) for shape in shapes)
    assert A @ solve(A, B) == pytest.approx(np.broadcast_to(B, (A @ solve(A, B)).shape), abs=1e-11)


def test_rows_are_exchanged_where_the_diagonal_vanishes():
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 2.0], [4.0, 0.0, 0.0]])
    assert (solve(A, np.eye(3)) == np.linalg.inv(A)).all()


def test_a_singular_matrix_has_no_finite_solution():
    assert not np.isfinite(solve(np.ones((2, 2)), np.eye(2))).all()


def test_a_matrix_is_positive_if_its_eigenvalues_are():
    for _ in range(50):
        A = symmetric(RANDOM.standard_normal((4, 4))) + 2.0 * np.eye(4)
        assert is_positive(A) == (np.linalg.eigvalsh(A)[0] > 0.0)
    assert not is_positive(np.stack([np.eye(2), -np.eye(2)]))


def test_the_riccati_equation_is_solved_as_by_lapack():
    for n, m in ((2, 1), (6, 2), (15, 4)):
        A, B = RANDOM.standard_normal((20, n, n)), RANDOM.standard_normal((20, n, m))
        root = RANDOM.standard_normal((m, m))
        Q, R = np.eye(n), root @ root.T + np.eye(m)
        S = riccati(A, B, Q, R)
        assert (transposed(S) == S).all()
        for i in range(20):
            theirs = solve_continuous_are(A[i], B[i], Q, R)
            assert np.abs(S[i] - theirs).max() < 1e-9 * np.abs(theirs).max()


def test_a_pole_at_the_shift_is_no_obstacle():
    A, B = np.diag([10.0, -10.0]), np.array([[1.0], [1.0]])
    S = riccati(A, B, np.eye(2), np.eye(1))
    assert pytest.approx(solve_continuous_are(A, B, np.eye(2), np.eye(1))) == S


@pytest.mark.parametrize("pole", [1.0, 0.0])
def test_what_cannot_be_controlled_has_no_solution(pole):
    with pytest.raises(SitlError, match="Riccati"):
        riccati(np.diag([pole, -1.0]), np.array([[0.0], [1.0]]), np.eye(2), np.eye(1))
