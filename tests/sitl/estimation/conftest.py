"""A look at what a reading would correct."""

import numpy as np
import pytest

from sitl.estimation import fusion
from sitl.estimation.filter import put_nominal
from sitl.estimation.nominal_state import (
    ERRORS,
)
from tests.support.flights.ideal_sensors import WANDERING, aboard
from tests.support.flights.observed_cruise import (
    AIR,
    CRUISE,
)


@pytest.fixture
def looked(monkeypatch):
    """A function that observes under a belief, and gives derivative and innovation of every scalar it would fuse."""
    return _looker(monkeypatch, arena=False)


@pytest.fixture
def looked_in_arena(monkeypatch):
    """The same on motion capture."""
    return _looker(monkeypatch, arena=True)


def _looker(monkeypatch, *, arena):
    i, f, _ = aboard(WANDERING, assumed=WANDERING, arena=arena)
    f["covariance"][:] = 1e3 * np.eye(ERRORS)  # nothing is refused
    f["covariance"][AIR, AIR] = 1e-4 * np.eye(3)  # and the wind's spread bends nothing
    f["on_ground"] = False
    seen = []

    def note(state, reading, first, count):
        seen.append((state.H.copy(), reading.innovation, first, reading.variance))
        state.H[:] = 0.0
        return 0.0

    monkeypatch.setattr(fusion, "correct", note)

    def look(observe, belief=CRUISE):
        seen.clear()
        put_nominal(f, belief)
        observe(f, i)
        return list(seen)

    return look
