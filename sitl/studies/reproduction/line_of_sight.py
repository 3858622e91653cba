"""Flights under the report's line-of-sight law, alone with the plant (report, section 4.2.3)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl.compiled import entry, subroutine
from sitl.design.trim import level_trim
from sitl.model.actuators import limited
from sitl.model.airframe import Airframe, Array
from sitl.model.ground import feet_aloft
from sitl.model.plant import step_in_air
from sitl.model.quaternions import Quaternion, rotate_inverse
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import Vector, norm
from sitl.studies.reproduction import report_forward
from sitl.studies.reproduction.report_forward import LineOfSightGains

TICK, SUBSTEPS = 0.002, 2  # as the vehicle's
ALOFT = 5000.0  # the ground is out of the picture [m]
CRUISE = 480.0  # motors at the start [rad/s]; the report does not say
SAMPLE = 10  # ticks between recorded samples
COLUMNS = 16  # of a sample: p (3), v (3), q (4), actuators (4), angle off the line of sight, sideslip


class Flight(NamedTuple):
    """A flight, one row per 20 ms; positions relative to the start."""

    time: Array  # (n,)
    p: Array  # (n, 3) world NWU [m]
    v: Array  # (n, 3) world NWU [m/s]
    q: Array  # (n, 4)
    actuator: Array  # (n, 4) w1, w2 [rad/s], d1, d2 [rad]
    off: Array  # (n,) angle between velocity and line of sight [rad]
    sideslip: Array  # (n,) [rad]

    def at(self, time: float) -> int:
        """Row of a time [s]."""
        return min(round(time / (SAMPLE * TICK)), self.time.size - 1)

    @property
    def nose(self) -> Array:
        """Nose above the horizon, (n,) [rad]."""
        q = self.q
        return np.asarray(np.arcsin(np.clip(2.0 * (q[:, 1] * q[:, 3] - q[:, 0] * q[:, 2]), -1.0, 1.0)))

    @property
    def climb(self) -> Array:
        """Path above the horizon, (n,) [rad]."""
        return np.asarray(np.arctan2(self.v[:, 2], np.hypot(self.v[:, 0], self.v[:, 1])))


def fly(target: tuple[float, float, float], gains: LineOfSightGains, *, speed: float, duration: float) -> Flight:
    """Fly as the report does: from 10 m/s north, level, at q = (1, 0, 0, 0), in still air.

    Args:
        target: Relative to the start, world NWU [m].
        gains: Gains of the law, with the airframe that flies.
        speed: Wanted v_bx [m/s].
        duration: [s].
    """
    still = Vector(0.0, 0.0, 0.0)
    body = Body(Vector(0.0, 0.0, ALOFT), Vector(10.0, 0.0, 0.0), Quaternion(1.0, 0.0, 0.0, 0.0), still)
    plant = Plant(body, Actuators(CRUISE, CRUISE, 0.0, 0.0), feet_aloft())
    to = Vector(float(target[0]), float(target[1]), float(target[2]) + ALOFT)
    rows = np.zeros((round(duration / TICK / SAMPLE), COLUMNS))
    _loop(plant, to, float(speed), gains, gains.a, rows)
    rows[:, 2] -= ALOFT
    return Flight(
        np.arange(len(rows), dtype=np.float64) * (SAMPLE * TICK), rows[:, :3], rows[:, 3:6], rows[:, 6:10],
        rows[:, 10:14], rows[:, 14], rows[:, 15],
    )  # fmt: skip


@entry
def _loop(plant: Plant, target: Vector, speed: float, gains: LineOfSightGains, a: Airframe, rows: Array) -> None:
    still, command = Vector(0.0, 0.0, 0.0), plant.actuators
    law = report_forward.start(command, gains)
    for row in rows:
        _record(row, plant, target)
        for _ in range(SAMPLE):
            T1, T2, d1, d2 = report_forward.control(plant.body, still, target, speed, gains, TICK, law)
            wanted = limited(command, True, a)
            for _ in range(SUBSTEPS):
                plant = step_in_air(plant, wanted, still, a, TICK / SUBSTEPS)
            command = Actuators(math.sqrt(T1 / a.k_f), math.sqrt(T2 / a.k_f), d1, d2)  # of the next tick


@subroutine
def _record(row: Array, plant: Plant, target: Vector) -> None:
    p, v, q, _ = plant.body
    row[0], row[1], row[2] = p
    row[3], row[4], row[5] = v
    row[6], row[7], row[8], row[9] = q
    row[10], row[11], row[12], row[13] = plant.actuators
    v_b = rotate_inverse(q, v)
    row[14] = report_forward.line_of_sight(plant.body, target)[1]
    row[15] = math.asin(v_b.y / max(norm(v_b), 1e-9))


def conditioning(a: Airframe, speed: float, *, swapped: bool) -> float:
    """Condition number of dM/du_bar in the level trim at a speed [m/s]; infinite where it is singular."""
    trim = level_trim(a, speed)
    v_b = np.array([speed * math.cos(trim.theta), 0.0, -speed * math.sin(trim.theta)])
    command = np.array([2.0 * trim.thrust, 0.0, 2.0 * trim.delta, 0.0])
    _, J = report_forward.model(v_b, speed, command, LineOfSightGains(a, swapped=int(swapped)))
    return float(np.linalg.cond(J))
