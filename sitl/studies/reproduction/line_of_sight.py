"""Flights under the report's line-of-sight law, alone with the plant (report, section 4.2.3)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.design.trim import level_trim
from sitl.kernels.integrate import plant_step
from sitl.model.airframe import Airframe, Array
from sitl.kernels.quaternion import rotate_inverse
from sitl.kernels.state import ACTUATOR, ANCHOR, SIZE, P, Q, V
from sitl.laws import report_forward
from sitl.laws.report_forward import LineOfSightGains

TICK, SUBSTEPS = 0.002, 2  # as the vehicle's
ALOFT = 5000.0  # the ground is out of the picture [m]
CRUISE = 480.0  # motors at the start [rad/s]; the report does not say
SAMPLE = 10  # ticks between recorded samples
RECORD = ANCHOR + 2  # plant, LOS error, sideslip


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
    plant = np.zeros(SIZE)
    plant[ANCHOR:] = math.nan
    plant[P + 2], plant[V], plant[Q] = ALOFT, 10.0, 1.0
    plant[ACTUATOR : ACTUATOR + 2] = CRUISE
    rows = np.zeros((round(duration / TICK / SAMPLE), RECORD))
    _loop(plant, np.array(target) + plant[P : P + 3], speed, gains, gains.a, rows)
    rows[:, P + 2] -= ALOFT
    return Flight(
        np.arange(len(rows), dtype=np.float64) * (SAMPLE * TICK), rows[:, P:V], rows[:, V:Q], rows[:, Q : Q + 4],
        rows[:, ACTUATOR:ANCHOR], rows[:, ANCHOR], rows[:, ANCHOR + 1],
    )  # fmt: skip


@njit(cache=True)
def _loop(plant: Array, target: Array, speed: float, gains: LineOfSightGains, a: Airframe, rows: Array) -> None:
    law, u, still = np.zeros(report_forward.SIZE), np.zeros(4), np.zeros(3)
    command = plant[ACTUATOR:ANCHOR].copy()
    staged = command.copy()
    report_forward.reset(plant, law, gains)
    for row in rows:
        row[:ANCHOR] = plant[:ANCHOR]
        _, row[ANCHOR] = report_forward.line_of_sight(plant, target)
        v_b = rotate_inverse(plant[Q : Q + 4], plant[V : V + 3])
        row[ANCHOR + 1] = math.asin(v_b[1] / max(math.sqrt(v_b @ v_b), 1e-9))
        for _ in range(SAMPLE):
            report_forward.control(plant, still, target, speed, gains, TICK, law, u)
            staged[0], staged[1] = math.sqrt(u[0] / a.k_f), math.sqrt(u[1] / a.k_f)
            staged[2], staged[3] = u[2], u[3]
            for _ in range(SUBSTEPS):
                plant_step(plant, command, still, True, a, TICK / SUBSTEPS)
            command[:] = staged


def conditioning(a: Airframe, speed: float, *, swapped: bool) -> float:
    """Condition number of dM/du_bar in the level trim at a speed [m/s]; infinite where it is singular."""
    trim = level_trim(a, speed)
    v_b = np.array([speed * math.cos(trim.theta), 0.0, -speed * math.sin(trim.theta)])
    command = np.array([2.0 * trim.thrust, 0.0, 2.0 * trim.delta, 0.0])
    _, J = report_forward.model(v_b, speed, command, LineOfSightGains(a, swapped=int(swapped)))
    return float(np.linalg.cond(J))
