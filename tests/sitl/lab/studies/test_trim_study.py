"""Costs of trims, and the speeds at which no trim exists."""

import math

import numpy as np
import pytest

from sitl.design.trim import level_trim, trims
from sitl.design.turn import turning_trim
from sitl.lab.studies.trim_study import cost, gaps
from sitl.model.airframe_files import load

NOMINAL, PUBLISHED = load("nominal").parameters, load("published").parameters


def test_gaps_are_written_as_ranges_of_speed():
    speeds = np.arange(0.0, 26.0)
    assert gaps(speeds, trims(NOMINAL, speeds)) == ""
    assert gaps(speeds, trims(PUBLISHED, speeds)) == "none at 6-9 m/s"
    assert gaps(speeds[6:9], trims(PUBLISHED, speeds[6:9])) == "none"
    assert gaps(speeds, trims(NOMINAL, speeds, math.radians(-15.0))) == "none at 5-7, 13-25 m/s"


def test_the_cost_per_metre_falls_with_airspeed_and_grows_in_turns():
    costs = [cost(NOMINAL, level_trim(NOMINAL, v)) for v in (5.0, 10.0, 15.0, 20.0, 25.0)]
    assert costs == pytest.approx([29.0, 5.40, 1.56, 0.86, 0.73], rel=0.01)
    assert cost(NOMINAL, level_trim(NOMINAL, 0.0)) == math.inf
    turn = turning_trim(NOMINAL, 15.0, 0.5)
    assert cost(NOMINAL, turn) > costs[2]
