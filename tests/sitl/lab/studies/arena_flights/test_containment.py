"""Flights under a net: in calm nothing comes near it, and what is counted."""

import pytest

from sitl import SitlError
from sitl.lab.studies import containment
from sitl.lab.studies.containment import ContainmentConditions, ContainmentEnd, FlownContainment, fly_containment
from sitl.lab.studies.seeded_flights import Craft
from sitl.simulation.avionics import Navigation

MOCAP = Craft(navigation=Navigation.MOCAP)
CALM = ContainmentConditions(seed=1, wall=0.0, burst=0.0, turbulence=0.0)


def test_in_calm_no_request_leads_to_the_net():
    flown = fly_containment(CALM, craft=MOCAP)
    assert flown.end is ContainmentEnd.FLEW_ON
    assert flown.room > 0.7  # requests keep 1.2 m; 0.98 m was the least of twenty seeds
    assert flown.accepted_outside == 0
    assert flown.refused > 5


def test_a_seed_is_one_flight(monkeypatch):
    monkeypatch.setattr(containment, "REQUESTS", 2)
    windy = ContainmentConditions(seed=2, wall=3.0, burst=1.0, turbulence=0.05)
    first, again = (fly_containment(windy, craft=Craft(navigation=Navigation.TRUTH)) for _ in range(2))
    assert first == again
    assert first.room != fly_containment(CALM, craft=Craft(navigation=Navigation.TRUTH)).room


def test_it_needs_a_net():
    with pytest.raises(SitlError, match="--arena open: there is no net"):
        fly_containment(CALM, "open")


def flight(**changed):
    values = {
        "seed": 1, "wall": 0.0, "burst": 0.0, "end": ContainmentEnd.FLEW_ON, "room": 1.0, "holds": 2, "refused": 8,
        "accepted_outside": 0,
    }  # fmt: skip
    return FlownContainment(**values | changed)


def test_the_summary_counts_how_they_ended():
    flights = [flight(), flight(room=0.5), flight(wall=4.0, end=ContainmentEnd.CUT), flight(accepted_outside=1)]
    lines = containment.summary(flights)
    assert lines[1].split() == ["0", "0", "3", "1.00", "/", "0.55", "/", "0.50", "2.0", "0", "0", "0", "3", "0"]
    assert lines[2].split()[-5:] == ["0", "1", "0", "0", "0"]
    assert lines[3] == "points outside: 33 asked for, 1 accepted"
