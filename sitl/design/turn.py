"""Trims of the full plant in steady turns (report, section 4.1).

A turn has no closed form: its equations are solved by continuation from straight flight.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl.compiled import entry, subroutine
from sitl.design.matrices import solve
from sitl.design.trim import level_trim
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import sine_cosine
from sitl.model.plant import derivative, inflow
from sitl.model.propeller import speed_for
from sitl.model.quaternions import Quaternion, from_euler, multiply, rotate_inverse
from sitl.model.state import Actuators, Body
from sitl.model.vectors import Vector

CONTINUATION_STEP = 0.1  # of the continuation, in turn rate [rad/s] or bank [rad]
DIFFERENCE = 1e-6  # of the central differences in Newton's method
MAX_ITERATIONS = 30
MIN_SHARE = 1e-3  # of a Newton step
BALANCED = 1e-9  # residual of a solved turn [m/s2, rad/s2]


class TurningTrim(NamedTuple):
    """A steady turn without sideslip, about the vertical, climbing or not; NaN where none was found.

    Its velocity is that of the moment at which it flies north, the world frame NWU.
    """

    speed: float  # through the air [m/s]
    climb: float  # angle of the path above the horizon [rad]
    turn_rate: float  # about the vertical, to the left positive [rad/s]
    bank: float  # of the wings about the velocity, into a left turn positive [rad]
    incidence: float  # of the nose over the velocity [rad]
    q: Array  # attitude, (4,)
    rates: Array  # of the body, (3,) [rad/s]
    thrust: Array  # left and right [N]
    delta: Array  # left and right [rad]
    omega: Array  # left and right [rad/s]
    margin: float  # what the more deflected elevon has left [rad]
    motor_margin: float  # what the motor nearer to a limit has left [rad/s]

    @property
    def exists(self) -> bool:
        """Whether the actuators can hold it."""
        return self.margin >= 0.0 and self.motor_margin >= 0.0

    @property
    def theta(self) -> float:
        """The nose above the horizon [rad]."""
        w, i, j, k = self.q
        return float(np.arcsin(np.clip(2.0 * (i * k - w * j), -1.0, 1.0)))


def turning_trim(a: Airframe, speed: float, turn_rate: float, climb: float = 0.0) -> TurningTrim:
    """The steady turn at a rate.

    Args:
        a: The airframe.
        speed: Through the air [m/s], >= 0.
        turn_rate: About the vertical, to the left positive [rad/s].
        climb: Angle of the path above the horizon [rad].
    """
    return _turn(a, float(speed), float(climb), float(turn_rate), banked=False)


def banked_trim(a: Airframe, speed: float, bank: float, climb: float = 0.0) -> TurningTrim:
    """The steady turn at a bank.

    Args:
        a: The airframe.
        speed: Through the air [m/s], > 0: without speed a bank is no turn.
        bank: Of the wings about the velocity, into a left turn positive [rad].
        climb: Angle of the path above the horizon [rad].
    """
    return _turn(a, float(speed), float(climb), float(bank), banked=True)


def _turn(a: Airframe, speed: float, climb: float, asked: float, *, banked: bool) -> TurningTrim:
    """Follow the turn from straight flight to what is asked; each step starts where the last two point."""
    start = level_trim(a, speed, climb)
    now = np.array((start.theta - climb, 0.0, start.thrust, start.thrust, start.delta, start.delta))
    before, steps = now, math.ceil(abs(asked) / CONTINUATION_STEP)
    for step in range(1, steps + 1):
        if not np.isfinite(now).all():
            break
        before, now = now, _solved(a, speed, climb, 2.0 * now - before, asked * step / steps, banked=banked)
    return _described(a, speed, climb, now, asked, banked=banked)


def _solved(a: Airframe, speed: float, climb: float, unknown: Array, known: float, *, banked: bool) -> Array:
    """Newton's method from a guess until it gets no better, each step halved until it helps; NaN if that is no turn."""
    left, jacobian = _linear(a, speed, climb, unknown, known, banked)
    for _ in range(MAX_ITERATIONS):
        size, step, share = np.abs(left).max(), solve(jacobian, left[:, None])[:, 0], 1.0
        found = _linear(a, speed, climb, unknown - step, known, banked)
        while size > BALANCED and not np.abs(found[0]).max() < size and share > MIN_SHARE:
            share *= 0.5
            found = _linear(a, speed, climb, unknown - share * step, known, banked)
        if not np.abs(found[0]).max() < size:
            break
        unknown, left, jacobian = unknown - share * step, *found
    return unknown if np.abs(left).max() < BALANCED else np.full(6, np.nan)


@entry
def _linear(a: Airframe, speed: float, climb: float, unknown: Array, known: float, banked: bool) -> tuple[Array, Array]:
    """Unbalanced accelerations of a turn [m/s2, rad/s2], (6,), and their Jacobian by the unknowns, (6, 6).

    Args:
        a: The airframe.
        speed: [m/s].
        climb: [rad].
        unknown: Incidence, bank or turn rate whichever is not known, both thrusts and both elevons, (6,).
        known: The other of bank and turn rate.
        banked: Whether it is the bank that is known.
    """
    jacobian = np.empty((6, 6))
    for column in range(6):
        ahead, behind = unknown.copy(), unknown.copy()
        ahead[column] += DIFFERENCE
        behind[column] -= DIFFERENCE
        rise, fall = (
            _unbalanced(a, speed, climb, ahead, known, banked),
            _unbalanced(a, speed, climb, behind, known, banked),
        )
        for row in range(6):
            jacobian[row, column] = (rise[row] - fall[row]) / (2.0 * DIFFERENCE)
    return _unbalanced(a, speed, climb, unknown, known, banked), jacobian


@subroutine
def _unbalanced(a: Airframe, speed: float, climb: float, unknown: Array, known: float, banked: bool) -> Array:
    bank, turn_rate = (known, unknown[1]) if banked else (unknown[1], known)
    rise, run = sine_cosine(climb)
    q, rates = _flown(climb, bank, unknown[0], turn_rate)
    free = Vector(0.0, 0.0, 0.0)
    body = Body(free, Vector(speed * run, 0.0, speed * rise), q, rates)
    ahead = inflow(body, free)
    w1, w2 = speed_for(unknown[2], ahead, a), speed_for(unknown[3], ahead, a)
    rate = derivative(body, Actuators(w1, w2, unknown[4], unknown[5]), free, free, free, a)
    v, w = rate.velocity, rate.rates
    # less the turn's own acceleration, to the left of north
    return np.array((v.x, v.y - turn_rate * (speed * run), v.z, w.x, w.y, w.z))


@subroutine
def _flown(climb: float, bank: float, incidence: float, turn_rate: float) -> tuple[Quaternion, Vector]:
    """Attitude of a vehicle that flies north, nose up from the velocity, banked about it; and its body rates."""
    q = multiply(from_euler(-bank, -climb, 0.0), from_euler(0.0, -incidence, 0.0))
    return q, rotate_inverse(q, Vector(0.0, 0.0, turn_rate))


def _described(a: Airframe, speed: float, climb: float, solved: Array, known: float, *, banked: bool) -> TurningTrim:
    bank, turn_rate = (known, float(solved[1])) if banked else (float(solved[1]), known)
    q, rates = _flown(climb, bank, float(solved[0]), turn_rate)
    thrust, delta = solved[2:4], solved[4:]
    ahead = speed * math.cos(float(solved[0]))
    omega = np.array([speed_for(one, ahead, a) for one in thrust.tolist()])
    margin = a.delta_max - float(np.abs(delta).max())
    motor_margin = float(np.minimum(omega - a.omega_min, a.omega_max - omega).min())
    return TurningTrim(
        speed=speed,
        climb=climb,
        turn_rate=turn_rate,
        bank=bank,
        incidence=float(solved[0]),
        q=np.array(q),
        rates=np.array(rates),
        thrust=thrust,
        delta=delta,
        omega=omega,
        margin=margin,
        motor_margin=motor_margin,
    )
