"""From forward flight to hover."""

import numpy as np
import pytest

from sitl import Law, Regime
from sitl.design.trim import level_trim
from sitl.lab.reproduction.experiments import hover_flights
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


# Domain of attraction of the printed linear gain, by the share of starts that come home.


PUBLISHED = load("published").parameters


def test_starts_are_spread_evenly():
    towards = hover_flights.directions(200)
    assert np.linalg.norm(towards, axis=1) == pytest.approx(np.ones(200))
    assert np.abs(towards.mean(axis=0)).max() < 0.01
    assert towards.T @ towards / 200 == pytest.approx(np.eye(3) / 3.0, abs=0.01)


@pytest.mark.long
def test_the_printed_gain_comes_home_from_near_and_at_the_printed_threshold_only_in_the_hover_model():
    assert hover_flights.share_home(PUBLISHED, 20.0) == 100.0
    assert hover_flights.share_home(PUBLISHED, 250.0) < 60.0
    ideal = PUBLISHED._replace(rho=0.0, omega_rate=hover_flights.UNLIMITED, delta_rate=hover_flights.UNLIMITED)
    assert hover_flights.share_home(ideal, 250.0) == 100.0
