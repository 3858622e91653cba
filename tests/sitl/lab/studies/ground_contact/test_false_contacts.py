"""Hours in the air: what is flown, and what is counted."""

import pytest

from sitl.lab.studies import landings
from sitl.lab.studies.landings import LongFlight, air_passed, air_summary, fly_in_air
from sitl.lab.studies.seeded_flights import Craft
from sitl.simulation.avionics import Navigation

WELL = LongFlight(seed=1, wind=9.0, gusts=1.5, flown=600.0, lowest=21.0, false_contact="", crashed=False)


def test_a_flight_of_holds_legs_and_descents_stays_in_the_air(monkeypatch):
    monkeypatch.setattr(landings, "LONG_FLIGHT_TIME", 90.0)
    flown = fly_in_air(4, Craft("physical", Navigation.TRUTH), 6.0, 1.0)
    assert flown.flown == pytest.approx(90.0)
    assert flown.lowest > 10.0
    assert air_passed([flown])


def test_a_touch_down_in_the_air_fails_the_study_and_is_named():
    false = WELL._replace(seed=5, flown=61.0, false_contact="TO_HOVER after 61 s, 40 m up")
    assert not air_passed([WELL, false])
    lines = "\n".join(air_summary([WELL, false]))
    assert lines.startswith("2 flights, seeds 1 to 5: 0.2 h in the air, 1 false touch-downs")
    assert "seed 5: wind 9.0 m/s, gusts 1.5 m/s: touch-down in TO_HOVER after 61 s, 40 m up" in lines
