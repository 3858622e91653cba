r"""A hover gain by linear matrix inequalities: the LQR's cost with a guaranteed decay, whatever the effectiveness.

The report's perspective (conclusion). Over every effectiveness of motors and elevons within ``spread``, one V = x' S x
and one K shall give

.. math:: \dot V \le -2 \alpha V - x' (Q + K' R K) x , \qquad Q = I, R = \rho I .

With X = S^-1 and Y = K X this is linear in X and Y, and affine in B, so that the corners of the effectiveness suffice.
S bounds the LQR's cost: V keeps its meaning, and without spread and decay it is the LQR's.

The vehicle is its own mirror image. So what happens in its plane of symmetry and what happens across it are two
problems, of six states each; :mod:`sitl.design.inequalities` solves them.
"""

from __future__ import annotations

import math
from itertools import product as pairs

import numpy as np

from sitl.control.hover_linear import LinearGains
from sitl.design import linearise
from sitl.design.inequalities import least_cost
from sitl.design.lqr import law
from sitl.design.matrices import product
from sitl.errors import SitlError
from sitl.model.airframe import Airframe, Array

DECAY = 0.3  # alpha [1/s]; the LQR's own V guarantees 0.37, and 0.30 over the spread
SPREAD = 0.2  # of the effectiveness of motors and elevons, either way
LMI_EFFORT = 20.0  # weight of u' u in the cost: with the LQR's 1 the elevons saturate on the smallest errors
SLACK = 1e-6  # of the decay that rounding may take [1/s]
# States within the plane of symmetry: x, z, their rates, e2, q; and across it: y, its rate, e1, e3, p, r.
HALVES = (0, 2, 3, 5, 7, 10), (1, 4, 6, 8, 9, 11)
# Inputs of both sides alike, and opposite ones, (4, 2).
INPUT_SHARE = math.sqrt(0.5)
TOGETHER = np.array([[INPUT_SHARE, 0.0], [INPUT_SHARE, 0.0], [0.0, INPUT_SHARE], [0.0, INPUT_SHARE]])
OPPOSED = np.array([[INPUT_SHARE, 0.0], [-INPUT_SHARE, 0.0], [0.0, INPUT_SHARE], [0.0, -INPUT_SHARE]])


def lmi_gains(a: Airframe, *, decay: float = DECAY, spread: float = SPREAD, effort: float = LMI_EFFORT) -> LinearGains:
    """Gains of least guaranteed cost with a decay rate of V, verified afterwards.

    Args:
        a: The airframe.
        decay: Wanted alpha in V' <= -2 alpha V [1/s], >= 0.
        spread: Effectiveness of motors and of elevons within 1 -+ spread, in [0, 1).
        effort: Weight rho of u' u in the cost, > 0.

    Returns:
        K, S = X^-1 and no integral; V = x' S x.

    Raises:
        SitlError: If an argument is out of range, or double precision does not suffice for these.
    """
    if not (0.0 <= decay < np.inf and 0.0 <= spread < 1.0 and 0.0 < effort < np.inf):
        raise SitlError(f"decay {decay} must be at least 0, spread {spread} in [0, 1) and effort {effort} positive")
    A, corners = linearise.hover(a)[0], effectiveness(a, spread)
    K, S = np.zeros((4, 12)), np.zeros((12, 12))
    for states, inputs in zip(HALVES, (TOGETHER, OPPOSED), strict=True):
        own = np.ix_(states, states)
        K_half, S[own] = least_cost(A[own], product(np.stack(corners)[:, states], inputs), decay, effort)
        K[:, states] = product(inputs, K_half)
    gains = law(a, K, np.zeros((4, 3)), S)
    reached = guaranteed_decay(A, corners, gains.K, gains.S)
    if not reached >= decay - SLACK:
        raise SitlError(f"the LMI's solution guarantees a decay of {reached:.4f} 1/s only, {decay} were asked for")
    return gains


def effectiveness(a: Airframe, spread: float) -> list[Array]:
    """Input matrices at the corners, the least effective first, each (12, 4).

    A motor of effectiveness s gives s T, and with it s times the slipstream of its elevon, whose own effectiveness
    multiplies that. Both motors err alike, and both elevons.
    """
    B = linearise.hover(a)[1]
    ends = (1.0 - spread, 1.0 + spread) if spread > 0.0 else (1.0,)
    return [B * np.array([motor, motor, motor * elevon, motor * elevon]) for motor, elevon in pairs(ends, ends)]


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
