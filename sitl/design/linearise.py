"""Linear models of the hover and of level flight (report, sections 3.1.2 and 4.1).

The quaternion lives on the unit sphere, so eta = sqrt(1 - |eps|^2) moves with eps. The report holds eta still,
which leaves -sqrt2 g in its dv_z/deps_2; ``constrained=False`` is that reading.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl.compiled import entry, subroutine
from sitl.design.matrices import product
from sitl.design.trim import Trim
from sitl.model.aerodynamics import force_matrix, inertia, moment_matrix, wrench
from sitl.model.airframe import STALL, Airframe, Array
from sitl.model.arithmetic import sine_cosine
from sitl.model.plant import derivative, inflow
from sitl.model.propeller import hover_speed, speed_for, thrust
from sitl.model.quaternions import Quaternion
from sitl.model.state import Actuators, Body
from sitl.model.vectors import Vector

MODEL_DIFFERENCE = 1e-5  # of the central differences: their error is below 1e-8
FORWARD_STATES = slice(2, 12)  # what of (p, v, eps, w) the forward model keeps: p_z and the rest


def hover(a: Airframe, *, constrained: bool = True) -> tuple[Array, Array]:
    """Hover at heading 0 of the hover model, in closed form; with what the slipstream adds, where the set has it.

    Args:
        a: The airframe.
        constrained: Whether eta moves with eps.

    Returns:
        A (12, 12) and B (12, 4) of x = (p, v, eps - eps_bar, w) and u = (T1, T2, d1 T1, d2 T2).
    """
    r = math.sqrt(2.0)
    A = np.zeros((12, 12))
    A[0:3, 3:6] = np.eye(3)
    A[3, 7], A[4, 6], A[4, 8] = 2.0 * r * a.g, -r * a.g, r * a.g
    A[5, 7] = 0.0 if constrained else -r * a.g
    A[6:9, 9:12] = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]]) / (2.0 * r)
    R = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # R(q_bar)
    B = np.zeros((12, 4))
    B[3:6] = product(R, force_matrix(a)) / a.m
    B[9:12] = moment_matrix(a) / inertia(a)[:, None]
    if a.aerodynamics == STALL:
        A[3:6, 3:6], A[3:6, 9:12], A[9:12, 3:6], A[9:12, 9:12] = _hover_drag(a)
    return A, B


def _hover_drag(a: Airframe) -> tuple[Array, Array, Array, Array]:
    """Jacobians of v' and w' by v and w at hover: the wing in its slipstream resists motion across it, (3, 3) each."""
    free, still = Vector(0.0, 0.0, 0.0), math.sqrt(0.5)
    speed = hover_speed(a)
    blocks = np.zeros((6, 6))
    for column in range(6):
        rates = []
        for step in (MODEL_DIFFERENCE, -MODEL_DIFFERENCE):
            x = [0.0] * 6
            x[column] = step
            body = Body(free, Vector(*x[:3]), Quaternion(still, 0.0, -still, 0.0), Vector(*x[3:]))
            # The thrust is what the law sets, whatever the inflow.
            omega = speed_for(thrust(speed, 0.0, a), inflow(body, free), a)
            rate = derivative(body, Actuators(omega, omega, 0.0, 0.0), free, free, free, a)
            rates.append(np.array((*rate.velocity, *rate.rates)))
        blocks[:, column] = (rates[0] - rates[1]) / (2.0 * MODEL_DIFFERENCE)
    return blocks[:3, :3], blocks[:3, 3:], blocks[3:, :3], blocks[3:, 3:]


class Air(NamedTuple):
    """(f / m, tau / J) per h of (v_b, w) as the plant has them, (6, 6).

    An elevon in the stream is one that is more effective, by kappa = h v_bx / (2 X T); that is not in these.
    """

    still: Array  # without elevons
    both: Array  # per d1 + d2
    differ: Array  # per d1 - d2


def aerodynamics(a: Airframe) -> Air:
    """The matrices of the airspeed's effects."""
    unit = a._replace(mu=1.0 / a.c**2)  # makes eta = 1 of each unit vector
    weight = np.concatenate((np.full(3, a.m), inertia(a))) * 0.5 * a.rho * a.S

    def effect(v: Array, d1: float, d2: float) -> Array:
        force, moment = wrench(Vector(*v[:3].tolist()), Vector(*v[3:].tolist()), Actuators(0.0, 0.0, d1, d2), unit)
        effective = np.vstack([force_matrix(a), moment_matrix(a)])[:, 2:] @ (d1, d2) * (0.5 * v[0] / a.S_ratio)
        return np.asarray(np.array((*force, *moment)) - 0.5 * a.rho * a.S * effective)

    def matrix(d1: float, d2: float) -> Array:
        return np.asarray(np.array([effect(v, d1, d2) for v in np.eye(6)]).T / weight[:, None])

    still = matrix(0.0, 0.0)
    return Air(still, matrix(0.5, 0.5) - still, matrix(0.5, -0.5) - still)


def forward(a: Airframe, trim: Trim, *, constrained: bool = True) -> tuple[Array, Array]:
    """Level flight north of the full plant, by central differences.

    Args:
        a: The airframe.
        trim: Where to linearise.
        constrained: Whether eta moves with eps.

    Returns:
        A (10, 10) and B (10, 4) of x = (p_z, v, eps - eps_bar, w) and u = (T1, T2 [N], d1, d2 [rad]).
    """
    flight = StraightFlight(trim.speed, trim.climb, trim.theta, trim.thrust, trim.delta)
    A, B = differences(a, flight, constrained)
    return A[FORWARD_STATES, FORWARD_STATES], B[FORWARD_STATES]


class StraightFlight(NamedTuple):
    """Straight flight, in balance or not."""

    speed: float  # through the air [m/s]
    climb: float  # angle of the path above the horizon [rad]
    theta: float  # nose above the horizon [rad]
    thrust: float  # of each motor [N]
    delta: float  # of each elevon [rad]


@entry
def differences(a: Airframe, flight: StraightFlight, constrained: bool) -> tuple[Array, Array]:
    """Jacobians of the plant there: of (p, v, eps, w)' by themselves (12, 12), and by (T1, T2, d1, d2) (12, 4)."""
    speed, climb, theta, thrust, delta = flight
    rise, run = sine_cosine(climb)
    s, eta = sine_cosine(0.5 * theta)
    x, u = np.zeros(12), np.array((thrust, thrust, delta, delta))
    x[3], x[5], x[7] = speed * run, speed * rise, -s
    A, B = np.empty((12, 12)), np.empty((12, 4))
    for column in range(16):
        ahead_x, behind_x, ahead_u, behind_u = x.copy(), x.copy(), u.copy(), u.copy()
        if column < 12:
            ahead_x[column] += MODEL_DIFFERENCE
            behind_x[column] -= MODEL_DIFFERENCE
        else:
            ahead_u[column - 12] += MODEL_DIFFERENCE
            behind_u[column - 12] -= MODEL_DIFFERENCE
        ahead, behind = _rates(ahead_x, ahead_u, eta, constrained, a), _rates(behind_x, behind_u, eta, constrained, a)
        for row in range(12):
            slope = (ahead[row] - behind[row]) / (2.0 * MODEL_DIFFERENCE)
            if column < 12:
                A[row, column] = slope
            else:
                B[row, column - 12] = slope
    return A, B


@subroutine
def _rates(x: Array, u: Array, eta: float, constrained: bool, a: Airframe) -> Array:
    """Derivative of x = (p, v, eps, w) in still air, with eta as it was or as eps leaves it, (12,)."""
    body = Body(
        Vector(x[0], x[1], x[2]),
        Vector(x[3], x[4], x[5]),
        Quaternion(math.sqrt(1.0 - x[6] * x[6] - x[7] * x[7] - x[8] * x[8]) if constrained else eta, x[6], x[7], x[8]),
        Vector(x[9], x[10], x[11]),
    )
    free = Vector(0.0, 0.0, 0.0)
    ahead = inflow(body, free)
    actuators = Actuators(speed_for(u[0], ahead, a), speed_for(u[1], ahead, a), u[2], u[3])
    p, v, q, w = derivative(body, actuators, free, free, free, a)
    return np.array((p.x, p.y, p.z, v.x, v.y, v.z, q.x, q.y, q.z, w.x, w.y, w.z))
