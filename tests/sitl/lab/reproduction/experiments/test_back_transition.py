"""From forward flight to hover."""

import numpy as np

from sitl import Law, Regime
from sitl.design.trim import level_trim
from sitl.lab.reproduction.experiments.hover_flights import CRUISE_SPEED, fly_from_cruise
from sitl.model.airframe_files import load

NOMINAL = load("nominal").parameters


def test_the_flight_begins_in_trimmed_forward_flight_and_ends_in_the_hover():
    track = fly_from_cruise(NOMINAL, 1)
    trim = level_trim(NOMINAL, CRUISE_SPEED)
    assert Law(int(track.law[0])).regime is Regime.FORWARD
    assert np.linalg.norm(track.v[0]) > 0.99 * CRUISE_SPEED
    soon = track.time < 1.0
    assert np.abs(track.v[soon] - [CRUISE_SPEED, 0.0, 0.0]).max() < 0.3
    assert np.abs(track.actuator[soon, 0] - trim.omega).max() < 30.0
    assert np.abs(track.p[-1] - [100.0, 0.0, 0.0]).max() < 0.5
    assert Law(int(track.law[-1])) is Law.HOVER_LINEAR
