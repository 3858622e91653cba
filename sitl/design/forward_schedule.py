"""Gains of the linear forward law: an LQR about the level trim of every airspeed (report, section 4.1)."""

from __future__ import annotations

import math

import numpy as np

from sitl.control.forward_flight.forward_linear import ForwardError, ForwardGains
from sitl.design import linearise
from sitl.design.lqr import lqr
from sitl.design.matrices import product
from sitl.design.rounding import rounded_matrix
from sitl.design.trim import Trim, balances, trims
from sitl.errors import SitlError
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import sine_cosine

STATES = len(ForwardError._fields)  # y, n, v, e, w
TURN = slice(5, 8)  # where e is
SPEEDS = np.linspace(0.0, 25.0, 51)  # [m/s]
CLIMBS = np.radians(np.linspace(-30.0, 45.0, 31))
WEIGHTS = np.diag(2 * [1.0] + 3 * [0.5] + 3 * [20.0] + 3 * [0.3])  # of y, n, v, e, w
FORWARD_EFFORT = np.array([2.0, 2.0, 8.0, 8.0])  # of T1, T2, d1, d2 at rest
FLOW = 10.0  # airspeed at which an elevon's effort weighs twice that [m/s]


def model(a: Airframe, trim: Trim) -> tuple[Array, Array]:
    """The plant about a straight trim in the coordinates of the forward law.

    Args:
        a: The airframe.
        trim: Where to linearise.

    Returns:
        A (11, 11) and B (11, 4) of x = (y, n, v - v_e, e, w) and u = (T1, T2 [N], d1, d2 [rad]).
    """
    A, B = np.zeros((STATES, STATES)), np.zeros((STATES, 4))
    A[1:, 1:], B[1:] = linearise.forward(a, trim)
    rise, run = sine_cosine(trim.climb)
    A[0, 3] = 1.0
    A[1, 2:5] = -rise, 0.0, run
    # eps - eps_bar = (eta_bar I + [eps_bar]) e
    s, eta = sine_cosine(0.5 * trim.theta)
    from_e = np.array([[eta, 0.0, -s], [0.0, eta, 0.0], [s, 0.0, eta]])
    to_e = np.array([[eta, 0.0, s], [0.0, 1.0 / eta, 0.0], [-s, 0.0, eta]])
    A[:, TURN] = product(A[:, TURN], from_e)
    A[TURN], B[TURN] = product(to_e, A[TURN]), product(to_e, B[TURN])
    return A, B


def forward_gains(a: Airframe) -> ForwardGains:
    """Gains of the law for an airframe, whether its actuators can hold every trim or not.

    The elevons' effort weighs 1 + (V / 10 m/s)^2 times more at an airspeed: they gain as much in effect, and without
    it the fastest pole reaches 330 rad/s at 25 m/s, which no servo follows.

    Raises:
        SitlError: If the model has no level trim at a speed, whatever the elevons' limits.
    """
    level = trims(a, SPEEDS)
    for trim in level:
        if not (math.isfinite(trim.delta) and trim.thrust > 0.0):
            raise SitlError(
                f"no forward law: nothing balances level flight at {trim.speed:g} m/s, elevons at any angle"
            )
    A, B = (np.stack(matrices) for matrices in zip(*(model(a, trim) for trim in level), strict=True))
    weight = 1.0 + (SPEEDS / FLOW) * (SPEEDS / FLOW)
    R = (
        np.eye(4)
        * FORWARD_EFFORT
        * np.stack((np.ones_like(weight), np.ones_like(weight), weight, weight), axis=1)[:, None]
    )
    K, S = lqr(A, B, WEIGHTS, R)
    speed, climb = (grid.ravel() for grid in np.meshgrid(SPEEDS, CLIMBS, indexing="ij"))
    table = balances(a, speed, climb, np.zeros_like(speed)).reshape(SPEEDS.size, CLIMBS.size, -1)
    theta, thrust, delta = (rounded_matrix(table[..., i]) for i in range(3))
    return ForwardGains(
        speeds=SPEEDS,
        climbs=CLIMBS,
        K=np.stack([rounded_matrix(gain) for gain in K]),
        S=np.stack([rounded_matrix(cost) for cost in S]),
        theta=theta,
        thrust=thrust,
        delta=delta,
    )
