"""The lowest level at which V rises on the plant: no certificate of this V can be larger."""

from __future__ import annotations

import math

import numpy as np

from sitl import Airframe, Array, Body, Quaternion, Vector
from sitl.compiled import entry, subroutine
from sitl.control.allocation import allocate
from sitl.control.hover_linear import SQRT_HALF, HoverError, LinearGains, control
from sitl.lab.proofs.closed_loop import lyapunov_matrix
from sitl.model.plant import derivative, inflow

MAX_LEVEL = 100.0  # of V where it is looked for a rise


def lyapunov_rate(x: Array, gains: LinearGains, a: Airframe) -> float:
    """V' on the full plant in still air, actuators at what the allocation commands [1/s]; NaN for |eps| > 1.

    Args:
        x: Deviation in the heading frame with eta > 0, and the integral if V has one, (12,) or (15,).
        gains: Gains of the law.
        a: The airframe.
    """
    return float(_rate_at(_whole(x), _form(gains), gains, a))


def _whole(x: Array) -> Array:
    return np.concatenate((x, np.zeros(15 - x.size)))


def _form(gains: LinearGains) -> Array:
    return np.ascontiguousarray(np.block([[gains.S, gains.S_xi], [gains.S_xi.T, gains.S_ii]]))


@entry
def _rate_at(x: Array, P: Array, gains: LinearGains, a: Airframe) -> float:
    return _rate(x, P, gains, a)


@subroutine
def _rate(x: Array, P: Array, gains: LinearGains, a: Airframe) -> float:
    e1, e2, e3 = x[6], x[7] - SQRT_HALF, x[8]
    eta = 1.0 - e1 * e1 - e2 * e2 - e3 * e3
    if eta < 0.0:
        return math.nan
    v, rates, free = Vector(x[3], x[4], x[5]), Vector(x[9], x[10], x[11]), Vector(0.0, 0.0, 0.0)
    seen = HoverError(Vector(x[0], x[1], x[2]), v, Vector(x[6], x[7], x[8]), rates)
    body = Body(free, v, Quaternion(math.sqrt(eta), e1, e2, e3), rates)
    command, _ = allocate(control(seen, Vector(x[12], x[13], x[14]), 0.0, gains), a, inflow(body, free))
    p, v, q, w = derivative(body, command, free, free, free, a)
    grown = (x[0] + gains.lead * p.x, x[1] + gains.lead * p.y, x[2] + gains.lead * p.z)
    moved = (p.x, p.y, p.z, v.x, v.y, v.z, q.x, q.y, q.z, w.x, w.y, w.z, grown[0], grown[1], grown[2])
    rate = 0.0
    for row in range(15):
        for column in range(15):
            rate += 2.0 * x[row] * P[row, column] * moved[column]
    return rate


def first_rise(a: Airframe, gains: LinearGains, *, searches: int = 6, seed: int = 1) -> float:
    """A V at which V' = 0 somewhere, found by descent over directions: no certificate of this V can be larger.

    Args:
        a: The airframe.
        gains: The law.
        searches: How many descents, from the best of random directions.
        seed: Of the directions.
    """
    from scipy.optimize import minimize  # noqa: PLC0415 - half a second that only this search needs

    form = lyapunov_matrix(gains) if gains.S_ii.any() else gains.S
    to_x, P = np.linalg.inv(np.linalg.cholesky(form)), _form(gains)

    def rise(y: Array) -> float:
        return float(_rise_along(_whole(y / np.linalg.norm(y) @ to_x), P, gains, a))

    directions = np.random.default_rng(seed).standard_normal((300, len(form)))
    best = sorted(directions, key=rise)[:searches]
    options = {"maxiter": 2000, "adaptive": True, "fatol": 1e-4, "xatol": 1e-3}
    return float(min(minimize(rise, y, method="Nelder-Mead", options=options).fun for y in best))


@entry
def _rise_along(x: Array, P: Array, gains: LinearGains, a: Airframe) -> float:
    """The V from which on V' is no longer negative along a ray, to 1 %; infinite if there is none on the chart."""
    level = 1e-3
    while level < MAX_LEVEL:
        rate = _rate(math.sqrt(level) * x, P, gains, a)
        if not rate < 0.0:
            return math.inf if math.isnan(rate) else level
        level *= 1.01
    return math.inf
