"""The zero-moment law on the plain quadrotor, where its model is exact."""

from typing import NamedTuple

import numpy as np

from sitl.lab.reproduction.equations import quadrotor
from sitl.lab.reproduction.equations.quadrotor import QUADROTOR
from sitl.model.quaternions import from_euler
from sitl.sensors.draws import PERIOD
from tests.support.flights.estimates import vector


class Flight(NamedTuple):
    """Per tick."""

    distance: np.ndarray  # from the target [m]
    f_delta: np.ndarray  # (n, 3) [N]
    q: np.ndarray  # (n, 4)
    cut: np.ndarray  # whether a thrust was


def fly(target, gains, *, duration, attitude=(0.0, 0.0, 0.0), heading=0.0):
    """From rest at the origin."""
    start, upright = from_euler(*attitude), from_euler(0.0, 0.0, heading)
    flight = quadrotor.fly(start, vector(target), upright, gains, QUADROTOR, round(duration / PERIOD))
    distance = np.linalg.norm(flight.position - np.array(target), axis=1)
    return Flight(distance, flight.f_delta, flight.attitude, flight.is_limited > 0.0)
