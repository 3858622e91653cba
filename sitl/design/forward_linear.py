"""Gains of the linear forward law: an LQR about the level trim of every airspeed (report, section 4.1)."""

from __future__ import annotations

import math

import numpy as np

from sitl.design import linearise
from sitl.design.lqr import lqr
from sitl.design.trim import Trim, level_trim
from sitl.errors import SitlError
from sitl.model.airframe import Airframe, Array
from sitl.laws.forward_linear import STATES, ForwardGains

SPEEDS = np.linspace(0.0, 25.0, 51)  # [m/s]
CLIMBS = np.radians(np.linspace(-30.0, 45.0, 31))
WEIGHTS = np.diag(2 * [1.0] + 3 * [0.5] + 3 * [20.0] + 3 * [0.3])  # of y, n, v, e, w
EFFORT = np.array([2.0, 2.0, 8.0, 8.0])  # of T1, T2, d1, d2 at rest
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
    A[0, 3] = 1.0
    A[1, 2:5] = -math.sin(trim.climb), 0.0, math.cos(trim.climb)
    # eps - eps_bar = (eta_bar I + [eps_bar]) e
    eta, eps = math.cos(0.5 * trim.theta), -math.sin(0.5 * trim.theta)
    T = np.eye(STATES)
    T[5:8, 5:8] = np.array([[eta, 0.0, eps], [0.0, eta, 0.0], [-eps, 0.0, eta]])
    return np.asarray(np.linalg.solve(T, A @ T)), np.asarray(np.linalg.solve(T, B))


def forward_gains(a: Airframe) -> ForwardGains:
    """Gains of the law for an airframe, whether its actuators can hold every trim or not.

    The elevons' effort weighs 1 + (V / 10 m/s)^2 times more at an airspeed: they gain as much in effect, and without
    it the fastest pole reaches 330 rad/s at 25 m/s, which no servo follows.

    Raises:
        SitlError: If the model has no level trim at a speed, whatever the elevons' limits.
    """
    K, S = np.empty((SPEEDS.size, 4, STATES)), np.empty((SPEEDS.size, STATES, STATES))
    for i, speed in enumerate(SPEEDS):
        trim = level_trim(a, float(speed))
        if not (math.isfinite(trim.delta) and trim.thrust > 0.0):
            raise SitlError(f"no forward law: nothing balances level flight at {speed:g} m/s, elevons at any angle")
        effort = EFFORT * (1.0, 1.0, 1.0 + (speed / FLOW) ** 2, 1.0 + (speed / FLOW) ** 2)
        K[i], S[i] = lqr(*model(a, trim), WEIGHTS, np.diag(effort))
    trims = [[level_trim(a, float(speed), float(climb)) for climb in CLIMBS] for speed in SPEEDS]
    theta, thrust, delta = (
        np.array([[getattr(trim, name) for trim in row] for row in trims]) for name in ("theta", "thrust", "delta")
    )
    return ForwardGains(SPEEDS, CLIMBS, K, S, theta, thrust, delta)
