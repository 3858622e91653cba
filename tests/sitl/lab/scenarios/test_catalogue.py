"""The flights of the report under the vehicle's supervisor: each number is as the report or the design expects."""

import pytest

from sitl.lab.scenarios import SCENARIOS, fly


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_finding_of_a_report_scenario_is_as_expected(name):
    track = fly(SCENARIOS[name])
    missed = [f"{f.name} = {f.value:.3f} {f.unit}" for f in SCENARIOS[name].findings(track) if not f.holds]
    assert not missed
