"""The zero-moment law on the plain quadrotor, where its model is exact."""

from typing import NamedTuple

import numpy as np

from sitl.model.quaternions import from_euler
from sitl.studies.reproduction import quadrotor
from sitl.studies.reproduction.quadrotor import QUADROTOR, TICK
from tests.support.estimates import vector


class Flight(NamedTuple):
    """Per tick."""

    distance: np.ndarray  # from the target [m]
    f_delta: np.ndarray  # (n, 3) [N]
    q: np.ndarray  # (n, 4)
    cut: np.ndarray  # whether a thrust was


def fly(target, gains, *, duration, attitude=(0.0, 0.0, 0.0), heading=0.0):
    """From rest at the origin."""
    start, upright = from_euler(*attitude), from_euler(0.0, 0.0, heading)
    rows = quadrotor.fly(start, vector(target), upright, gains, QUADROTOR, round(duration / TICK))
    distance = np.linalg.norm(rows[:, :3] - np.array(target), axis=1)
    return Flight(distance, rows[:, 3:6], rows[:, 6:10], rows[:, 10] > 0.0)
