"""Holds in the jet: the wind moves the vehicle, gusts more so, and the map has every cell."""

import math

import pytest

from sitl.__main__ import main
from sitl.lab.campaigns.campaign_run import CampaignResult
from sitl.lab.campaigns.campaign_summary import quantities
from sitl.lab.campaigns.case_flights import FlownCase
from sitl.lab.campaigns.specification import load_specification
from sitl.lab.studies.jet_holds import save_jet_map
from sitl.lab.studies.seeded_flights import Craft
from sitl.lab.studies.spec_studies import FlownStudy
from sitl.simulation.avionics import Navigation
from tests.support.campaigns import shipped


def flown(wall, gust):
    grids = {"vary.wall.grid": [wall], "vary.gust.grid": [gust]}
    return shipped("jet", grids, craft=Craft(navigation=Navigation.TRUTH)).measures


@pytest.mark.long
def test_calm_moves_nothing_and_gusts_in_the_jet_do():
    still, blown = flown(0.0, 0.0), flown(2.0, 2.0)
    assert still["farthest"] < 0.01
    assert 0.03 < blown["error"] < blown["farthest"] < 1.5
    assert blown["kept"]


def test_it_needs_a_wall(capsys):
    assert main(["study", "jet", "--arena", "open"]) == 2
    assert capsys.readouterr().err == "darko-sitl: --arena open: there is no wind wall\n"


def test_the_map_is_drawn(tmp_path):
    """Its last cell has no hold that was kept."""
    specification = load_specification("jet", {"vary.wall.grid": [2], "vary.gust.grid": [0, 1], "run.cases": 4})
    held, lost = (1.0, 0.1, 0.2), (0.0, math.inf, math.nan)
    cases = [FlownCase(number, "time", "", lost if number % 2 else held) for number in range(4)]
    study = FlownStudy(CampaignResult(specification, cases, ended_early=False), quantities(specification, range(4)), "")
    save_jet_map(study, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 1000
