"""Flights under the report's line-of-sight law, alone with the plant (report, section 4.2.3)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl import PERIOD, Actuators, Airframe, Array, Body, Plant, Quaternion, Vector
from sitl.compiled import entry, subroutine
from sitl.design.trim import level_trim
from sitl.lab.reproduction.equations import report_forward_law
from sitl.lab.reproduction.equations.report_forward_law import ReportForwardGains, ReportTarget
from sitl.model.actuators import limited
from sitl.model.ground import feet_aloft
from sitl.model.plant import step_in_air
from sitl.model.quaternions import rotate_inverse
from sitl.model.vectors import norm
from sitl.simulation.flight import SUBSTEPS

START_HEIGHT = 5000.0  # far above the ground [m]
START_MOTOR_SPEED = 480.0  # the report does not give it [rad/s]
PERIODS_PER_SAMPLE = 10


class ForwardFlight(NamedTuple):
    """A flight, one row per 20 ms; positions relative to the start."""

    time: Array  # (n,)
    p: Array  # (n, 3) world NWU [m]
    v: Array  # (n, 3) world NWU [m/s]
    q: Array  # (n, 4)
    actuator: Array  # (n, 4) w1, w2 [rad/s], d1, d2 [rad]
    angle_off: Array  # (n,) between velocity and line of sight [rad]
    sideslip: Array  # (n,) [rad]

    def at(self, time: float) -> int:
        """The row of a time [s]."""
        return min(round(time / (PERIODS_PER_SAMPLE * PERIOD)), self.time.size - 1)

    @property
    def nose(self) -> Array:
        """Angle of the nose above the horizon, (n,) [rad]."""
        q = self.q
        return np.asarray(np.arcsin(np.clip(2.0 * (q[:, 1] * q[:, 3] - q[:, 0] * q[:, 2]), -1.0, 1.0)))

    @property
    def climb(self) -> Array:
        """Angle of the path above the horizon, (n,) [rad]."""
        return np.asarray(np.arctan2(self.v[:, 2], np.hypot(self.v[:, 0], self.v[:, 1])))


def fly(
    target: tuple[float, float, float], gains: ReportForwardGains, *, speed: float, duration: float
) -> ForwardFlight:
    """Fly as the report does: from 10 m/s north, level, at q = (1, 0, 0, 0), in still air.

    Args:
        target: Relative to the start, world NWU [m].
        gains: Gains of the law, with the airframe that flies.
        speed: Wanted v_bx [m/s].
        duration: [s].
    """
    still = Vector(0.0, 0.0, 0.0)
    body = Body(Vector(0.0, 0.0, START_HEIGHT), Vector(10.0, 0.0, 0.0), Quaternion(1.0, 0.0, 0.0, 0.0), still)
    plant = Plant(body, Actuators(START_MOTOR_SPEED, START_MOTOR_SPEED, 0.0, 0.0), feet_aloft())
    to = Vector(float(target[0]), float(target[1]), float(target[2]) + START_HEIGHT)
    count = round(duration / PERIOD / PERIODS_PER_SAMPLE)
    flight = ForwardFlight(
        time=np.arange(count, dtype=np.float64) * (PERIODS_PER_SAMPLE * PERIOD),
        p=np.zeros((count, 3)),
        v=np.zeros((count, 3)),
        q=np.zeros((count, 4)),
        actuator=np.zeros((count, 4)),
        angle_off=np.zeros(count),
        sideslip=np.zeros(count),
    )
    _record_flight(flight, plant, ReportTarget(to, float(speed)), gains, gains.a)
    flight.p[:, 2] -= START_HEIGHT
    return flight


@entry
def _record_flight(
    flight: ForwardFlight, plant: Plant, goal: ReportTarget, gains: ReportForwardGains, a: Airframe
) -> None:
    still, command = Vector(0.0, 0.0, 0.0), plant.actuators
    law = report_forward_law.start(command, gains)
    for k in range(flight.time.shape[0]):
        _record_sample(flight, k, plant, goal.position)
        for _ in range(PERIODS_PER_SAMPLE):
            T1, T2, d1, d2 = report_forward_law.control(plant.body, still, goal, gains, PERIOD, law)
            in_force = limited(command, True, a)
            for _ in range(SUBSTEPS):
                plant = step_in_air(plant, in_force, still, a, PERIOD / SUBSTEPS)
            command = Actuators(math.sqrt(T1 / a.k_f), math.sqrt(T2 / a.k_f), d1, d2)  # of the next period


@subroutine
def _record_sample(flight: ForwardFlight, k: int, plant: Plant, target: Vector) -> None:
    p, v, q, _ = plant.body
    flight.p[k, 0], flight.p[k, 1], flight.p[k, 2] = p
    flight.v[k, 0], flight.v[k, 1], flight.v[k, 2] = v
    flight.q[k, 0], flight.q[k, 1], flight.q[k, 2], flight.q[k, 3] = q
    row = flight.actuator[k]
    row[0], row[1], row[2], row[3] = plant.actuators
    v_b = rotate_inverse(q, v)
    flight.angle_off[k] = report_forward_law.line_of_sight(plant.body, target)[1]
    flight.sideslip[k] = math.asin(v_b.y / max(norm(v_b), 1e-9))


def conditioning(a: Airframe, speed: float, *, swapped: bool) -> float:
    """Condition number of dM/du_bar in the level trim at a speed [m/s]; infinite where it is singular."""
    trim = level_trim(a, speed)
    v_b = np.array([speed * math.cos(trim.theta), 0.0, -speed * math.sin(trim.theta)])
    command = np.array([2.0 * trim.thrust, 0.0, 2.0 * trim.delta, 0.0])
    _, J = report_forward_law.model(v_b, speed, command, ReportForwardGains(a, swapped=int(swapped)))
    return float(np.linalg.cond(J))
