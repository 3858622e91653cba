"""Moments that the believed actuators do not explain."""

import pytest

from sitl.lab.studies.seeded_flights import Craft
from sitl.vehicle.actuator_watch import ActuatorWatch
from tests.support.campaigns import failing, shipped
from tests.support.flights.recorded_flight import NOMINAL, Flight


def unexplained(flight, seconds):
    watch, seen = ActuatorWatch(NOMINAL), []
    flight.fly(seconds, lambda: seen.append(watch.look(flight.vehicle.estimate_record, flight.vehicle.time)))
    return [max(moment) for moment in seen]


def test_a_leg_flown_forward_in_gusts_leaves_little_unexplained():
    flight = Flight(wind_speed=4.0, wind_from=60.0, gusts=1.0)
    flight.autopilot.guided.go_to((120.0, 0.0, 25.0))
    assert max(unexplained(flight, 15.0)) < 0.3


@pytest.mark.long
@pytest.mark.parametrize("unit", ["motor", "servo"])
def test_what_can_no_longer_be_flown_comes_down_with_its_motors_off(unit):
    flown = shipped("failures", failing(unit, "off", "cruise")).measures
    assert flown["motors_off"]
    assert flown["noticed"] < 10.0


@pytest.mark.long
def test_a_slow_elevon_is_flown_with():
    """By the report's laws; INDI shakes in the stop, and its motors are cut."""
    flown = shipped("failures", failing("servo", "slow", "cruise"), seed=2, craft=Craft(controller="report"))
    assert flown.end == "time"
