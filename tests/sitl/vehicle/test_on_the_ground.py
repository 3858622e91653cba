"""Armed on the ground: what waits stays where it stands, and what goes elsewhere rises first."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from sitl.autopilot.settings import Settings
from sitl.guidance.view import MIN_HOLD_HEIGHT
from sitl.lab.studies.seeded_flights import STUDY_WORLD, Craft
from sitl.model.quaternions import x_axis
from sitl.simulation.avionics import Navigation
from sitl.simulation.start import Start
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings
from tests.support.vehicle.mission_items import item, waypoint

DELAY = item(mavlink.MAV_CMD_NAV_DELAY, params=(15.0, -1.0, -1.0, -1.0))


def landing(north, west):
    return item(mavlink.MAV_CMD_NAV_LAND, north, west)


def parked(seed=1, controller="hybrid", wind=5.0, gusts=1.0):
    craft = Craft("collage", Navigation.TRUTH, controller=controller)
    vehicle = craft.fly(seed, Start())
    air = WorldSettings(wind, 40.0 * seed, gusts, battery=1e6)
    return Aircraft(vehicle, STUDY_WORLD, Configuration(Settings(), vehicle.tuning, air))


def started(aircraft, *items):
    aircraft.advance(50)
    aircraft.autopilot.missions.load(items)
    aircraft.autopilot.arming.arm(force=True)
    assert aircraft.autopilot.missions.start().text == ""
    return aircraft


def flown(aircraft, seconds):
    """Positions every 20 ms."""
    places = []
    for _ in range(round(seconds / 0.02)):
        aircraft.advance(10)
        places.append(aircraft.vehicle.truth.body.position)
    return places


@pytest.mark.parametrize("controller", ["hybrid", "indi"])
def test_a_mission_that_begins_with_a_delay_stands_until_it_is_over(controller):
    aircraft = started(parked(controller=controller), DELAY, waypoint(0.0, 0.0, 4.0))
    here = aircraft.vehicle.truth.body.position
    waits = flown(aircraft, 14.0)
    assert aircraft.vehicle.law is Law.LANDED
    assert aircraft.autopilot.armed
    assert max(math.dist(here, p) for p in waits) < 0.02
    flown(aircraft, 8.0)
    assert aircraft.vehicle.law is not Law.LANDED


def test_a_mission_that_ends_on_the_ground_stays_there():
    aircraft = started(parked(), DELAY)
    here = aircraft.vehicle.truth.body.position
    assert max(math.dist(here, p) for p in flown(aircraft, 25.0)) < 0.02
    assert aircraft.vehicle.law is Law.LANDED


@pytest.mark.long(after=1)
@pytest.mark.parametrize("items", [[landing(12.0, 0.0)], [waypoint(12.0, 0.0, 0.0), landing(12.0, 0.0)]])
@pytest.mark.parametrize("seed", [1, 2])
def test_what_goes_elsewhere_is_never_low_on_the_way(items, seed):
    aircraft = started(parked(seed), *items)
    places = flown(aircraft, 45.0)
    between = [p.z for p in places if 1.0 < p.x < 11.0]
    assert min(between) > 0.5 * MIN_HOLD_HEIGHT
    assert aircraft.vehicle.law is Law.LANDED
    assert aircraft.vehicle.truth.body.position.x == pytest.approx(12.0, abs=1.5)
    assert x_axis(aircraft.vehicle.truth.body.attitude).z > 0.9
