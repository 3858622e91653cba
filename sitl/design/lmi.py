r"""A hover gain by linear matrix inequalities: the LQR's cost with a guaranteed decay, whatever the effectiveness.

The report's perspective (conclusion). Over every effectiveness of motors and elevons within ``spread``, one V = x' S x
and one K shall give

.. math:: \dot V \le -2 \alpha V - x' (Q + K' R K) x , \qquad Q = I, R = \rho I .

With X = S^-1 and Y = K X this is linear in X and Y, and affine in B, so that the corners of the effectiveness suffice.
S bounds the LQR's cost: V keeps its meaning, and without spread and decay it is the LQR's.
"""

from __future__ import annotations

import math
import warnings
from itertools import product

import numpy as np

from sitl.design import linearise
from sitl.design.lqr import INTEGRAL_LIMIT, LEAD, hover_thrust, lqr
from sitl.errors import SitlError
from sitl.model.airframe import Airframe, Array
from sitl.laws.hover_linear import LinearGains

DECAY = 0.3  # alpha [1/s]; the LQR's own V guarantees 0.37, and 0.30 over the spread
SPREAD = 0.2  # of the effectiveness of motors and elevons, either way
EFFORT = 20.0  # weight of u' u in the cost: with the LQR's 1 the elevons saturate on the smallest errors
SLACK = 1e-5  # of the decay that the solver may miss [1/s]


def lmi_gains(a: Airframe, *, decay: float = DECAY, spread: float = SPREAD, effort: float = EFFORT) -> LinearGains:
    """Gains of least guaranteed cost with a decay rate of V, verified afterwards.

    Args:
        a: The airframe.
        decay: Wanted alpha in V' <= -2 alpha V [1/s], >= 0.
        spread: Effectiveness of motors and of elevons within 1 -+ spread, in [0, 1).
        effort: Weight rho of u' u in the cost, > 0.

    Returns:
        K, S = X^-1 and no integral; V = x' S x.

    Raises:
        SitlError: If an argument is out of range, no such gain exists, or what the solver returns fails the check.
    """
    if not (0.0 <= decay < np.inf and 0.0 <= spread < 1.0 and 0.0 < effort < np.inf):
        raise SitlError(f"decay {decay} must be at least 0, spread {spread} in [0, 1) and effort {effort} positive")
    A, corners = linearise.hover(a)[0], effectiveness(a, spread)
    K, S = _solve(A, corners, decay, effort)
    reached = guaranteed_decay(A, corners, K, S)
    if reached < decay - SLACK:
        raise SitlError(f"the LMI's solution guarantees a decay of {reached:.4f} 1/s only, {decay} were asked for")
    return LinearGains(K, np.zeros((4, 3)), S, hover_thrust(a), LEAD, INTEGRAL_LIMIT)


def effectiveness(a: Airframe, spread: float) -> list[Array]:
    """Input matrices at the corners, each (12, 4).

    A motor of effectiveness s gives s T, and with it s times the slipstream of its elevon, whose own effectiveness
    multiplies that. Both motors err alike, and both elevons.
    """
    B = linearise.hover(a)[1]
    ends = (1.0 - spread, 1.0 + spread) if spread > 0.0 else (1.0,)
    return [B * np.array([motor, motor, motor * elevon, motor * elevon]) for motor, elevon in product(ends, ends)]


def guaranteed_decay(A: Array, corners: list[Array], K: Array, S: Array) -> float:
    """The largest alpha with (A - B K)' S + S (A - B K) + 2 alpha S <= 0 at every corner [1/s].

    Args:
        A: State matrix, (12, 12).
        corners: Input matrices, each (12, 4).
        K: Gain, (4, 12).
        S: Of V = x' S x, (12, 12), positive definite.
    """
    back = np.linalg.inv(np.linalg.cholesky(S)).T
    rates = []
    for B in corners:
        half = back.T @ S @ (A - B @ K) @ back
        rates.append(-0.5 * np.linalg.eigvalsh(half + half.T).max())
    return float(min(rates))


def _solve(A: Array, corners: list[Array], decay: float, effort: float) -> tuple[Array, Array]:
    """K and S of least trace S."""
    import cvxpy as cp  # noqa: PLC0415 - seconds that only this design needs

    n, m = corners[0].shape
    S_lqr = lqr(A, corners[0], np.eye(n), effort * np.eye(m))[1]
    scale = np.sqrt(np.diag(S_lqr))  # states of like size keep the solver exact
    X, Y, Z = cp.Variable((n, n), symmetric=True), cp.Variable((m, n)), cp.Variable((n, n), symmetric=True)
    T, back = np.diag(scale), np.diag(1.0 / scale)
    constraints = [cp.bmat([[Z, T], [T, X]]) >> 0]
    for B in corners:
        drift = T @ A @ back @ X - T @ B @ Y
        top = drift + drift.T + 2.0 * decay * X
        cost = cp.vstack([back @ X, math.sqrt(effort) * Y])
        constraints.append(cp.bmat([[-top, cost.T], [cost, np.eye(n + m)]]) >> 0)
    problem = cp.Problem(cp.Minimize(cp.trace(Z)), constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of an inaccurate solution: it is verified
        try:
            problem.solve(solver=cp.CLARABEL)
        except cp.SolverError as error:
            raise SitlError(f"the LMI's solver gave up: {error}") from error
    if X.value is None:
        raise SitlError(f"no gain has a decay of {decay} 1/s over this spread: the LMI is {problem.status}")
    inverse = np.linalg.inv(X.value)
    S = T @ inverse @ T
    return np.ascontiguousarray(Y.value @ inverse @ T), 0.5 * (S + S.T)
