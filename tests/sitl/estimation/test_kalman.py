"""The Kalman filter's two steps against dense matrices, and that its covariance stays one."""

import numpy as np
import pytest

from sitl.compiled import entry
from sitl.estimation.kalman import (
    HEADING_BENDS,
    ErrorModel,
    ErrorState,
    ScalarReading,
    correct,
    inflate_biases,
    inflate_turned,
    innovation_ratio,
    predict,
    reset_block,
    transform_row,
    turn_errors,
)
from sitl.estimation.nominal_state import (
    ACCEL_BIAS_ERROR,
    AIR_ERRORS,
    ARENA_ERRORS,
    ATTITUDE_ERROR,
    ERRORS,
    GYRO_BIAS_ERROR,
    POSITION_ERROR,
    STEADY_WIND_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
)
from sitl.estimation.strapdown import Increment, increment_of, moved_by, rebiased
from sitl.model.quaternions import conjugate, from_euler, multiply, rotate, small_rotation
from sitl.model.vectors import Vector

NOT_GATED = 1e6
Q = from_euler(0.3, -1.2, 2.0)
STEP = Increment(small_rotation(Vector(0.01, -0.02, 0.03)), Vector(0.1, 0.02, -0.05), Vector(5e-4, 1e-4, -2e-4), 0.01)


def part(first):
    return slice(first, first + 3)


def matrix(q):
    return np.array([rotate(q, Vector(*axis)) for axis in np.eye(3)]).T


def skew(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def phi(q, i, fade):
    """The transition matrix as Solà writes it, with the local error of the attitude."""
    F, R, t = np.diag(fade), matrix(q), i.time
    place, speed, turn = part(POSITION_ERROR), part(VELOCITY_ERROR), part(ATTITUDE_ERROR)
    F[place, speed] = t * np.eye(3)
    F[place, turn], F[speed, turn] = -R @ skew(i.position), -R @ skew(i.velocity)
    F[turn, turn] = matrix(conjugate(i.rotation))
    F[place, part(ACCEL_BIAS_ERROR)], F[speed, part(ACCEL_BIAS_ERROR)] = -0.5 * t * t * R, -t * R
    F[turn, part(GYRO_BIAS_ERROR)] = -t * np.eye(3)
    F[part(WIND_ERROR), part(STEADY_WIND_ERROR)] = np.eye(3) - np.diag(fade[part(WIND_ERROR)])
    return F


def some_covariance(random, n=ERRORS):
    root = random.standard_normal((n, n)) * random.uniform(0.1, 2.0, n)[:, None]
    P = np.zeros((ERRORS, ERRORS))
    P[:n, :n] = root @ root.T
    return P


def some_row(random, n=ERRORS, entries=4):
    H = np.zeros(ERRORS)
    H[random.choice(n, entries, replace=False)] = random.standard_normal(entries)
    return H


@pytest.mark.parametrize("n", [ERRORS, ARENA_ERRORS])
def test_prediction_is_phi_p_phi_transposed_and_what_is_gained(n):
    random = np.random.default_rng(1)
    P, fade, spread = some_covariance(random, n), random.uniform(0.9, 1.0, ERRORS), random.uniform(0.0, 0.1, ERRORS)
    fade[:WIND_ERROR] = 1.0
    wanted = np.zeros((ERRORS, ERRORS))
    F = phi(Q, STEP, fade)[:n, :n]
    wanted[:n, :n] = F @ P[:n, :n] @ F.T + np.diag(spread[:n])
    predict(P, np.zeros((ERRORS, ERRORS)), n, Q, STEP, ErrorModel(fade, spread))
    assert np.abs(P - wanted).max() < 1e-11
    assert (P == P.T).all()


def test_the_transition_is_how_errors_grow():
    """The column of phi of each error against the same increment flown with and without that error."""

    def flown(errors):
        p, v = Vector(*errors[part(POSITION_ERROR)]), Vector(*errors[part(VELOCITY_ERROR)])
        turned = small_rotation(Vector(*errors[part(ATTITUDE_ERROR)]))
        i = rebiased(STEP, Vector(*errors[part(GYRO_BIAS_ERROR)]), Vector(*errors[part(ACCEL_BIAS_ERROR)]))
        return moved_by(i, p, v, multiply(Q, turned), 9.81)

    F, right, size = phi(Q, STEP, np.ones(ERRORS)), flown(np.zeros(ERRORS)), 1e-5
    for k in range(ACCEL_BIAS_ERROR + 3):
        errors = np.zeros(ERRORS)
        errors[k] = size
        wrong = flown(errors)
        off = turn_between(right[2], wrong[2])
        grown = np.concatenate([np.subtract(wrong[0], right[0]), np.subtract(wrong[1], right[1]), off]) / size
        # Biases act on the mean attitude of the increment, which phi takes for that at its beginning.
        assert grown == pytest.approx(F[:9, k], abs=5e-4), k


def turn_between(q, other):
    off = multiply(conjugate(q), other)
    return 2.0 * np.array(off[1:])


@pytest.mark.parametrize("n", [ERRORS, ARENA_ERRORS])
def test_correction_is_the_textbook_s(n):
    random = np.random.default_rng(2)
    P, H, errors = some_covariance(random, n), some_row(random, n), np.zeros(ERRORS)
    S = H @ P @ H + 0.3
    K = P @ H / S
    wanted = P - np.outer(K, H @ P)
    ratio = correct(
        ErrorState(P, H.copy(), np.zeros(ERRORS), errors, n), ScalarReading(0.7, 0.3, NOT_GATED, 0.0), 0, ERRORS
    )
    assert ratio == pytest.approx(0.7**2 / S)
    assert errors == pytest.approx(K * 0.7)
    assert np.abs(P - wanted).max() < 1e-11


def test_scalars_one_by_one_are_the_readings_all_at_once():
    random = np.random.default_rng(3)
    P = some_covariance(random)
    rows, innovations = np.array([some_row(random) for _ in range(3)]), np.array([0.4, -1.0, 2.0])
    noise = np.array([0.1, 0.5, 2.0])
    K = P @ rows.T @ np.linalg.inv(rows @ P @ rows.T + np.diag(noise))
    wanted, covariance = K @ innovations, P - K @ rows @ P
    errors = np.zeros(ERRORS)
    for H, innovation, variance in zip(rows, innovations, noise, strict=True):
        correct(
            ErrorState(P, H, np.zeros(ERRORS), errors, ERRORS),
            ScalarReading(innovation, variance, NOT_GATED, 0.0),
            0,
            ERRORS,
        )
        assert (H == 0.0).all()
    assert errors == pytest.approx(wanted)
    assert np.abs(P - covariance).max() < 1e-10


@pytest.mark.parametrize("caution", [0.0, 1.5])
def test_where_errors_are_only_considered_it_is_joseph_s_form_with_their_gain_zero(caution):
    random = np.random.default_rng(4)
    P, H, errors = some_covariance(random), some_row(random, entries=8), np.zeros(ERRORS)
    H[WIND_ERROR] = 0.8
    own = slice(WIND_ERROR, WIND_ERROR + AIR_ERRORS)
    K = np.zeros(ERRORS)
    K[own] = (P @ H)[own] / (H @ P @ H + 0.3 + caution)
    left = np.eye(ERRORS) - np.outer(K, H)
    wanted = left @ P @ left.T + 0.3 * np.outer(K, K)
    before = P.copy()
    correct(
        ErrorState(P, H.copy(), np.zeros(ERRORS), errors, ERRORS),
        ScalarReading(0.7, 0.3, NOT_GATED, caution),
        WIND_ERROR,
        AIR_ERRORS,
    )
    assert errors == pytest.approx(K * 0.7)
    assert np.abs(P - wanted).max() < 1e-11
    others = np.delete(np.arange(ERRORS), np.arange(WIND_ERROR, WIND_ERROR + AIR_ERRORS))
    assert (P[np.ix_(others, others)] == before[np.ix_(others, others)]).all()


def test_what_is_beyond_the_gate_changes_nothing_but_is_told():
    random = np.random.default_rng(5)
    P, H, errors = some_covariance(random), some_row(random), np.zeros(ERRORS)
    before, deviation = P.copy(), float(np.sqrt(H @ P @ H + 0.3))
    ratio = correct(
        ErrorState(P, H.copy(), np.zeros(ERRORS), errors, ERRORS),
        ScalarReading(5.01 * deviation, 0.3, 5.0, 0.0),
        0,
        ERRORS,
    )
    assert ratio == pytest.approx(5.01**2)
    assert np.array_equal(P, before)
    assert (errors == 0.0).all()
    correct(
        ErrorState(P, H.copy(), np.zeros(ERRORS), errors, ERRORS),
        ScalarReading(4.99 * deviation, 0.3, 5.0, 0.0),
        0,
        ERRORS,
    )
    assert (errors != 0.0).any()


def test_an_error_that_is_forgotten_is_alone_with_its_new_variance():
    P = some_covariance(np.random.default_rng(6))
    before = P.copy()
    reset_block(P, ATTITUDE_ERROR, 0.25)
    others = np.delete(np.arange(ERRORS), np.arange(ATTITUDE_ERROR, ATTITUDE_ERROR + 3))
    assert (P[part(ATTITUDE_ERROR), part(ATTITUDE_ERROR)] == 0.25 * np.eye(3)).all()
    assert not P[np.ix_(others, np.arange(ATTITUDE_ERROR, ATTITUDE_ERROR + 3))].any()
    assert (P[np.ix_(others, others)] == before[np.ix_(others, others)]).all()


@entry
def _predict(P, work, q, increment, fade, spread):
    predict(P, work, ERRORS, q, increment, ErrorModel(fade, spread))


@entry
def _correct(P, H, PH, errors, first, variance):
    correct(ErrorState(P, H, PH, errors, ERRORS), ScalarReading(0.1, variance, NOT_GATED, 0.0), first, AIR_ERRORS)


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2])
def test_the_covariance_stays_symmetric_and_positive_over_many_random_steps(seed):
    """Precise and vague readings by turns, of all errors and of those that are only considered."""
    random = np.random.default_rng(seed)
    P, work, PH, errors = np.diag(random.uniform(0.01, 4.0, ERRORS)), np.zeros((ERRORS, ERRORS)), np.zeros(ERRORS), None
    fade, spread = np.ones(ERRORS), np.full(ERRORS, 1e-9)
    fade[WIND_ERROR:] = 0.999
    for step in range(250):
        rates, force = Vector(*random.uniform(-3.0, 3.0, 3)), Vector(*random.uniform(-20.0, 20.0, 3))
        q = small_rotation(Vector(*random.uniform(-2.0, 2.0, 3)))
        _predict(P, work, q, increment_of(rates, force, 0.01), fade, spread)
        for _ in range(5):
            errors = np.zeros(ERRORS)
            first = WIND_ERROR if random.random() < 0.3 else 0
            variance = 10.0 ** random.uniform(-8.0, 2.0)
            _correct(P, some_row(random, entries=2), PH, errors, first, variance)
        if step % 20 == 0:
            scale = np.sqrt(np.diag(P))
            correlation = P / np.outer(scale, scale)
            assert np.abs(correlation - correlation.T).max() < 1e-9
            assert np.linalg.eigvalsh(0.5 * (correlation + correlation.T)).min() > -1e-7
            assert (scale > 0.0).all()
    assert np.isfinite(P).all()


@pytest.mark.parametrize("n", [ERRORS, ARENA_ERRORS])
def test_a_corrected_attitude_carries_its_errors_over(n):
    """The same true attitude, as an error from the belief before and from the one after: equation 287 of Solà."""
    random = np.random.default_rng(5)
    turn, P = Vector(0.05, -0.03, 0.08), some_covariance(random, n)
    J = np.eye(n)
    J[part(ATTITUDE_ERROR), part(ATTITUDE_ERROR)] -= 0.5 * skew(turn)
    wanted = J @ P[:n, :n] @ J.T
    turn_errors(P, n, turn)
    assert np.abs(P[:n, :n] - wanted).max() < 1e-12
    small = Vector(0.05 + 1e-3, -0.03 + 2e-3, 0.08 - 1e-3)  # the error before; what is left of it is exact below
    left = multiply(conjugate(small_rotation(turn)), small_rotation(small))
    exact = 2.0 * np.array([left.x, left.y, left.z])
    carried = J[part(ATTITUDE_ERROR), part(ATTITUDE_ERROR)] @ (np.array(small) - np.array(turn))
    assert np.abs(carried - exact).max() < 1e-5
    assert np.abs((np.array(small) - np.array(turn)) - exact).max() > 5e-5


def test_biases_are_as_loose_as_the_heading_and_no_tilt_makes_them_so():
    up = Vector(*(matrix(Q).T @ (0.0, 0.0, 1.0)))
    heading, level = np.outer(up, up), np.eye(3) - np.outer(up, up)
    for variance, gained in ((heading, HEADING_BENDS * 0.5), (level, 0.0)):
        P = np.zeros((ERRORS, ERRORS))
        P[part(ATTITUDE_ERROR), part(ATTITUDE_ERROR)] = variance
        before = P.copy()
        inflate_biases(P, up, 0.5)
        assert np.abs(np.diag(P - before)[part(ACCEL_BIAS_ERROR)] - gained).max() < 1e-15
        P[part(ACCEL_BIAS_ERROR), part(ACCEL_BIAS_ERROR)] = 0.0
        assert not (P - before).any()


def test_a_turn_by_axes_askew_makes_attitude_and_biases_less_sure():
    """A radian in a second, by axes that lie 5 mrad askew: as much, and what gravity reads of it."""
    P = some_covariance(np.random.default_rng(3))
    before = P.copy()
    for _ in range(100):
        inflate_turned(P, 0.01, 0.005, 9.81, 0.01)
    gained = np.zeros(ERRORS)
    gained[part(ATTITUDE_ERROR)], gained[part(ACCEL_BIAS_ERROR)] = 0.005**2, (9.81 * 0.005) ** 2
    assert P - before == pytest.approx(np.diag(gained), abs=1e-12)


@pytest.mark.parametrize("n", [ERRORS, ARENA_ERRORS])
def test_the_innovation_ratio_is_what_a_correction_would_find_and_changes_nothing(n):
    random = np.random.default_rng(7)
    P, H = some_covariance(random, n), some_row(random, n, entries=5)
    before = P.copy()
    found = innovation_ratio(P, H, n, 0.7, 0.3)
    assert found == pytest.approx(0.7**2 / (H @ P @ H + 0.3))
    assert np.array_equal(P, before)
    assert np.count_nonzero(H) == 5
    assert correct(
        ErrorState(P, H, np.zeros(ERRORS), np.zeros(ERRORS), n), ScalarReading(0.7, 0.3, NOT_GATED, 0.0), 0, 0
    ) == pytest.approx(found)


def test_an_error_that_becomes_a_sum_of_errors_is_as_large_as_that_sum():
    random = np.random.default_rng(7)
    P, H, row = some_covariance(random), some_row(random), 22
    G = np.eye(ERRORS)
    G[row] = H
    wanted = G @ P @ G.T
    transform_row(P, H, np.zeros(ERRORS), ERRORS, row)
    assert np.abs(P - wanted).max() < 1e-11
    assert not H.any()
