"""The flights of the report under the vehicle's supervisor: each figure is what the report or the design expects."""

import pytest

from sitl.studies.report import SCENARIOS
from sitl.studies.scenario import fly


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_scenario_of_the_report_holds_all_its_figures(name):
    track = fly(SCENARIOS[name])
    missed = [f"{f.name} = {f.value:.3f} {f.unit}" for f in SCENARIOS[name].figures(track) if not f.holds]
    assert not missed
