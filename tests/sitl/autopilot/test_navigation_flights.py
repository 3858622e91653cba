"""Flights on sensors that lose an instrument: what the vehicle says, and how it comes down."""

import math

import pytest

from protocol.dialect.vocabulary import Law, LegMode
from protocol.names import Mode
from sitl.autopilot.settings import Settings
from sitl.sensors.instruments import BAROMETER, GNSS, MAGNETOMETER, MOTION_CAPTURE, OFF, PITOT
from sitl.simulation.avionics import Navigation
from sitl.vehicle.aircraft import is_forward
from sitl.vehicle.parameters import WorldSettings
from tests.support.vehicle.fake_station import make_aircraft

LOST = "No position for 2 s: landing"


class Flight:
    """A flight on sensors, in light wind; ``texts`` are those to the pilot."""

    def __init__(self, up, *, navigation=Navigation.SENSORS, leg_mode=LegMode.HOVER, seed=1):
        wind = WorldSettings(wind_speed=2.0)
        self.aircraft = make_aircraft(
            up=up, settings=Settings(leg_mode=leg_mode), world_settings=wind, navigation=navigation, seed=seed
        )
        self.texts = []

    def fly(self, seconds):
        self.aircraft.advance(round(500 * seconds))
        self.texts += [notice.text for notice in self.aircraft.autopilot.notices()]

    def lose(self, instrument):
        self.aircraft.vehicle.avionics.instruments["failures"][instrument] = OFF

    def land(self, limit):
        end = self.aircraft.vehicle.time + limit
        while self.aircraft.autopilot.armed and self.aircraft.vehicle.time < end:
            self.fly(0.5)
        return self


def has_landed(flight):
    return flight.aircraft.view().tilt < math.radians(10.0) and flight.texts[-2:] == [
        "Landed",
        "Disarmed after landing",
    ]


@pytest.mark.parametrize(("navigation", "instrument"), [(Navigation.SENSORS, GNSS), (Navigation.MOCAP, MOTION_CAPTURE)])
def test_a_hover_without_position_lands_and_disarms(navigation, instrument):
    flight = Flight(4.0, navigation=navigation)
    flight.fly(6.0)
    flight.lose(instrument)
    flight.fly(1.5)
    assert flight.texts == []
    flight.fly(1.0)
    assert (flight.texts, flight.aircraft.autopilot.mode) == ([LOST], Mode.LAND)
    assert flight.aircraft.autopilot.failsafes.is_critical
    assert has_landed(flight.land(30.0))


def test_a_cruise_without_position_comes_to_rest_and_lands():
    flight = Flight(15.0, leg_mode=LegMode.FORWARD)
    flight.fly(5.0)
    assert flight.aircraft.autopilot.guided.go_to((500.0, 0.0, 15.0)).accepted
    flight.fly(8.0)
    assert is_forward(flight.aircraft.vehicle)
    flight.lose(GNSS)
    assert has_landed(flight.land(60.0))
    assert LOST in flight.texts


@pytest.mark.parametrize("seed", [1, 3])
def test_a_hover_in_wind_that_loses_its_position_lands_near_without_turning(seed):
    flight = Flight(5.0, seed=seed)
    flight.fly(6.0)
    heading = flight.aircraft.view().heading
    flight.lose(GNSS)
    turned = []  # until it stands: skidding feet may turn it a little then
    while flight.aircraft.vehicle.law is not Law.LANDED and flight.aircraft.vehicle.time < 40.0:
        flight.fly(0.1)
        turned.append(abs(math.remainder(flight.aircraft.view().heading - heading, math.tau)))
    assert max(turned[:-1]) < 0.2
    assert has_landed(flight.land(30.0))
    assert math.hypot(*flight.aircraft.vehicle.truth.body.position[:2]) < 5.0


def test_a_position_that_comes_back_is_said_and_does_not_stop_the_landing():
    flight = Flight(6.0)
    flight.fly(5.0)
    flight.lose(GNSS)
    flight.fly(2.5)
    flight.aircraft.vehicle.avionics.instruments["failures"][GNSS] = 0.0
    flight.fly(1.0)
    assert flight.texts == [LOST, "Position is back"]
    assert flight.aircraft.autopilot.mode is Mode.LAND


@pytest.mark.parametrize(
    ("instrument", "texts"),
    [(MAGNETOMETER, ["Flying without magnetometer"]), (BAROMETER, ["Flying without barometer"]), (PITOT, [])],
)
def test_without_another_instrument_it_flies_on(instrument, texts):
    flight = Flight(6.0)
    flight.fly(3.0)
    flight.lose(instrument)
    flight.fly(8.0)
    assert flight.texts == texts
    assert flight.aircraft.autopilot.mode is Mode.HOLD
    assert math.dist(flight.aircraft.vehicle.truth.body.position, (0.0, 0.0, 6.0)) < 2.0


@pytest.mark.parametrize(
    ("navigation", "height", "near"), [(Navigation.MOCAP, 2.0, 0.02), (Navigation.SENSORS, 15.0, 0.3)]
)
def test_after_a_crash_the_vehicle_knows_where_it_lies(navigation, height, near):
    flight = Flight(height, navigation=navigation)
    flight.fly(2.0)
    flight.aircraft.autopilot.arming.disarm(force=True)
    flight.fly(6.0)
    vehicle = flight.aircraft.vehicle
    assert vehicle.law is Law.CRASHED
    assert vehicle.estimate.position == pytest.approx(vehicle.truth.body.position, abs=near)
    assert vehicle.estimate.velocity == pytest.approx((0.0, 0.0, 0.0), abs=0.3)
