"""Flights of the whole vehicle under chosen hover laws, far above the ground."""

import math

import numpy as np

from sitl.airframe import load
from sitl.autopilot.guidance import Setpoint
from sitl.hybrid.supervisor import Law
from sitl.kernels.state import ACTUATOR, P, Q, V, W
from sitl.vehicle import TICK, DivergedError, Start, Tuning, Vehicle

NOMINAL = load("nominal").parameters
ALOFT = 500.0  # [m]
LINEAR_ALONE = {"v_enter": 0.5e9, "v_leave": 1e9}
ZERO_MOMENT_ALONE = {"v_enter": 0.0, "v_leave": math.inf}


class Flight:
    """What a flight was, one row per sample; positions are relative to the target."""

    def __init__(self, rows, vehicle, *, diverged):
        rows = np.array(rows)
        self.time, self.lyapunov = rows[:, 0], rows[:, 1]
        self.e, self.v, self.q = rows[:, 2 + P : 5 + P], rows[:, 2 + V : 5 + V], rows[:, 2 + Q : 6 + Q]
        self.actuator = rows[:, 2 + ACTUATOR : 6 + ACTUATOR]
        self.distance = np.linalg.norm(self.e, axis=1)
        self.tilt = np.arccos(np.clip(2.0 * (self.q[:, 1] * self.q[:, 3] - self.q[:, 0] * self.q[:, 2]), -1.0, 1.0))
        self.jumps, self.diverged = vehicle.jumps, diverged

    def settled(self, radius):
        """Time after which the error stays below ``radius`` [s]; infinite if it does not."""
        outside = np.flatnonzero(self.distance > radius)
        if self.diverged or (outside.size and outside[-1] + 1 == self.time.size):
            return math.inf
        return self.time[outside[-1] + 1] if outside.size else 0.0


def fly(target, *, law, duration, attitude=None, v=(0, 0, 0), w=(0, 0, 0), wind=(0, 0, 0), heading=0.0, **tuning):
    """Fly from rest at the origin; arguments as in ``Start`` and ``Tuning``, attitude a quaternion."""
    vehicle = Vehicle(NOMINAL, start=Start(up=ALOFT, heading=heading, airborne=True), tuning=Tuning(**tuning))
    aim = np.array(target, dtype=float) + vehicle.plant[P : P + 3]
    if attitude is not None:
        vehicle.plant[Q : Q + 4] = attitude
    vehicle.plant[V : V + 3], vehicle.plant[W : W + 3] = v, w
    vehicle.begin_flight(law)
    vehicle.set_wind(wind)
    vehicle.set_target(Setpoint(tuple(aim), heading, 3.0))
    vehicle.advance(0)
    rows = []
    for _ in range(round(duration / TICK / 5)):
        row = np.concatenate(((vehicle.time, vehicle.lyapunov), vehicle.plant))
        row[2:5] -= aim
        rows.append(row)
        try:
            vehicle.advance(5)
        except DivergedError:
            return Flight(rows, vehicle, diverged=True)
    return Flight(rows, vehicle, diverged=False)


__all__ = ["LINEAR_ALONE", "NOMINAL", "ZERO_MOMENT_ALONE", "Flight", "Law", "fly"]
