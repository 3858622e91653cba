"""Vehicle and autopilot together: parameters changed in flight, and equal flights with calls of any length."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, LegMode
from protocol.frames import LocalFrame
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.model.airframe_files import load
from sitl.sensors.instruments import DRIFTING, PITOT, STUCK, WRONG
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import GENTLE_GAIN, INDI, REPORTED, Tuning
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration
from tests.support.flights.recorded_flight import HIGH, Flight
from tests.support.vehicle.fake_station import make_aircraft

HERE = (0.0, 0.0, HIGH)
HOVERED, FLOWN = (Settings(leg_mode=leg_mode) for leg_mode in (LegMode.HOVER, LegMode.FORWARD))


def predicted(flight, settings, end):
    """The energy predicted of a leg, as it is asked for by whoever decides [J]."""
    chooser = flight.autopilot.chooser
    return chooser.energy(flight.aircraft.view(), HERE, end, settings, flying=False)


@pytest.mark.parametrize(
    ("settings", "west", "name", "value"),
    [
        (HOVERED, 60.0, "DRK_V_ENTER", 2.0),
        (HOVERED, 8.0, "DRK_V_LEAVE", 200.0),
        (HOVERED, 60.0, "DRK_LQI", 0),
        (HOVERED, 60.0, "DRK_KPP", 2.5),
        (HOVERED, 60.0, "DRK_KPD", 0.8),
        (HOVERED, 60.0, "DRK_KDELTA", 2.0),
        (HOVERED, 60.0, "DRK_LAMBDA", 5.0),
        (HOVERED, 60.0, "DRK_ZETA", 1.5),
        (HOVERED, 60.0, "DRK_LIN_DESIGN", 1),
        (HOVERED, 60.0, "DRK_HOV_VMAX", 2.0),
        (FLOWN, 60.0, "DRK_KQ", 2.0),
        (FLOWN, 60.0, "DRK_FWD_SPEED", 10.0),
    ],
)
def test_a_parameter_that_changes_the_flight_changes_its_prediction_at_once(settings, west, name, value):
    flight, end = Flight(settings=settings), (0.0, west, HIGH)
    # A law that is entered from afar, so that its parameters count.
    begun = {"DRK_CONTROLLER": REPORTED, "DRK_LIN_DESIGN": GENTLE_GAIN}
    flight.aircraft.configure(flight.aircraft.configuration.replaced(begun))
    before, first = predicted(flight, settings, end), flight.aircraft.configuration
    changed = first.replaced({name: value})
    flight.aircraft.configure(changed)
    assert flight.vehicle.tuning == flight.autopilot.chooser.tuning == changed.tuning
    after = predicted(flight, flight.autopilot.settings, end)
    assert abs(after - before) > 1e-4 * before
    flight.aircraft.configure(first)
    assert predicted(flight, settings, end) == before


def test_calls_of_any_length_fly_the_same_flight():
    flown = []
    for lengths in ((1000,), (10,) * 100, (3, 7, 13, 477, 500)):
        flight = Flight(gusts=0.5)
        flight.autopilot.guided.go_to((30.0, 10.0, HIGH + 5.0))
        for periods in lengths:
            flight.aircraft.advance(periods)
        flown.append(flight.vehicle.flight)
    assert flown[0] == flown[1] == flown[2]


@pytest.mark.parametrize("degrees", [-180, -120, 96, 150])
def test_no_step_of_the_heading_costs_height(degrees):
    flight = Flight()
    flight.autopilot.guided.go_to((0.0, 0.0, HIGH), heading=math.radians(degrees))
    flight.fly(12.0)
    assert flight.p[:, 2].min() > HIGH - 0.3
    assert math.remainder(flight.aircraft.view().heading - math.radians(degrees), math.tau) == pytest.approx(
        0.0, abs=0.2
    )


def in_the_cage(**parameters):
    """At the middle of the shipped flight cage."""
    start = Start(up=2.0, airborne=True)
    vehicle = Simulation(load("nominal").parameters, start=start)
    configuration = Configuration(Settings(), vehicle.tuning).replaced(parameters)
    return Aircraft(vehicle, World(LocalFrame(HOME), ARENAS["voliere"]), configuration, airborne=True)


def test_the_wind_wall_is_turned_on_and_gusts_by_parameters_in_flight():
    made = in_the_cage(SIM_WALL_TURB=0.0)
    made.advance(10)
    assert made.vehicle.wind == (0.0, 0.0, 0.0)
    made.configure(made.configuration.replaced({"SIM_WALL_SPD": 3.0}))
    made.advance(500)
    assert made.vehicle.wind.x == pytest.approx(-3.0, abs=0.05)
    made.configure(made.configuration.replaced({"SIM_WALL_GUST": 2.0, "SIM_WALL_GTIME": 2.0}))
    made.advance(500)
    assert made.vehicle.wind.x == pytest.approx(-5.0, abs=0.1)
    made.configure(made.configuration.replaced({"SIM_WALL_SPD": -1.0}))  # by the schedule, which says nothing
    made.advance(1000)
    assert made.vehicle.wind == pytest.approx((0.0, 0.0, 0.0))


def test_turbulence_of_the_wall_and_of_the_open_air_are_parameters():
    swirls = []
    for parameters in ({"SIM_WALL_SPD": 3.0, "SIM_WALL_TURB": 0.2}, {"SIM_TURB_W20": 8.0}):
        made = in_the_cage(**parameters)
        made.advance(500)
        swirls.append(abs(made.vehicle.wind.y))
    assert min(swirls) > 1e-3


def test_without_an_accelerometer_the_hybrid_controller_flies_instead_of_indi_and_a_parameter_does_not_change_that():
    aircraft = make_aircraft(up=30.0, navigation=Navigation.SENSORS)
    indi = aircraft.configuration._replace(tuning=Tuning(controller=INDI))
    aircraft.configure(indi)
    aircraft.advance(500)
    assert aircraft.vehicle.law is Law.INDI
    assert aircraft.failures.inject(mavlink.FAILURE_UNIT_SENSOR_ACCEL, STUCK).accepted
    aircraft.advance(500)
    assert aircraft.vehicle.law is not Law.INDI
    aircraft.configure(indi.replaced({"MPC_TKO_SPEED": 1.5}))
    assert aircraft.vehicle.tuning.controller == REPORTED
    assert aircraft.configuration.tuning.controller == INDI


def test_how_an_instrument_is_wrong_is_a_parameter():
    aircraft = make_aircraft(up=30.0, navigation=Navigation.SENSORS)
    aircraft.configure(aircraft.configuration.replaced({"SIM_FAIL_WRONG": 2, "SIM_FAIL_SIZE": -0.5}))
    answer = aircraft.failures.inject(mavlink.FAILURE_UNIT_SENSOR_AIRSPEED, WRONG)
    assert answer.text == "Failure injected: pitot tube drifting"
    instruments = aircraft.vehicle.avionics.instruments
    assert (instruments["failures"][PITOT], instruments["sizes"][PITOT]) == (DRIFTING, -0.5)
