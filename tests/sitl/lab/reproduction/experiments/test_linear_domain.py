"""Domain of attraction of the printed linear gain, by the share of starts that come home."""

import numpy as np
import pytest

from sitl.lab.reproduction.experiments import hover_flights
from sitl.model.airframe_files import load

PUBLISHED = load("published").parameters


def test_starts_are_spread_evenly():
    towards = hover_flights.directions(200)
    assert np.linalg.norm(towards, axis=1) == pytest.approx(np.ones(200))
    assert np.abs(towards.mean(axis=0)).max() < 0.01
    assert towards.T @ towards / 200 == pytest.approx(np.eye(3) / 3.0, abs=0.01)


def test_the_printed_gain_comes_home_from_near_and_at_the_printed_threshold_only_in_the_hover_model():
    assert hover_flights.share_home(PUBLISHED, 20.0) == 100.0
    assert hover_flights.share_home(PUBLISHED, 250.0) < 60.0
    ideal = PUBLISHED._replace(rho=0.0, omega_rate=hover_flights.UNLIMITED, delta_rate=hover_flights.UNLIMITED)
    assert hover_flights.share_home(ideal, 250.0) == 100.0
