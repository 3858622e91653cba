"""Holds in the jet: the wind moves the vehicle, gusts more so, and the map has every cell."""

import math

import pytest

from sitl import SitlError
from sitl.lab.studies import jet_holds
from sitl.lab.studies.containment import ContainmentConditions
from sitl.lab.studies.jet_holds import FlownJetHold, fly_jet_hold, save_jet_map
from sitl.lab.studies.seeded_flights import Craft
from sitl.simulation.avionics import Navigation

TRUTH = Craft(navigation=Navigation.TRUTH)


def flown(wall, burst):
    return fly_jet_hold(ContainmentConditions(seed=1, wall=wall, burst=burst, turbulence=0.05), craft=TRUTH)


def test_calm_moves_nothing_and_gusts_in_the_jet_do():
    still, blown = flown(0.0, 0.0), flown(2.0, 2.0)
    assert still.farthest < 0.01
    assert 0.03 < blown.error < blown.farthest < 1.5
    assert blown.fault == ""


def test_it_needs_a_wall():
    with pytest.raises(SitlError, match="--arena open: there is no wind wall"):
        fly_jet_hold(ContainmentConditions(1, 0.0, 0.0, 0.0), "open")


HOLDS = [
    FlownJetHold(1, 2.0, 0.0, 0.1, 0.2, ""),
    FlownJetHold(2, 2.0, 0.0, 0.3, 0.5, ""),
    FlownJetHold(1, 4.0, 1.0, math.inf, math.inf, "crashed into the net"),
]


def test_the_summary_has_a_line_for_each_cell():
    lines = [line.split() for line in jet_holds.summary(HOLDS)[1:]]
    assert lines == [["2", "0", "2", "0.20", "/", "0.30", "0.50", "0"], ["4", "1", "1", "-", "-", "1"]]


def test_the_map_is_drawn(tmp_path):
    save_jet_map(HOLDS, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 1000
