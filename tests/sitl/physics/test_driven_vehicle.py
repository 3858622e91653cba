import math
from itertools import pairwise

import pytest

from protocol.dialect.vocabulary import Law
from sitl.model.airframe_files import load
from sitl.model.state import Actuators
from sitl.physics.driven_vehicle import DrivenVehicle
from sitl.sensors.instruments import GNSS, OFF
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start

DARKO = load("darko").parameters


def vehicle(**start):
    return DrivenVehicle(DARKO, seed=1, start=Start(**start), sensors=load_sensors())


def test_the_commands_of_a_flight_move_the_plant_as_in_that_flight():
    flown = Simulation(DARKO, seed=3, start=Start(up=5.0, airborne=True))
    flown.set_wind((2.0, 1.0, 0.0), 1.0)
    flown.begin_flight(Law.HOVER_ZERO_MOMENT)
    driven = DrivenVehicle(DARKO, seed=3, start=Start(up=5.0, airborne=True), sensors=load_sensors())
    driven.set_wind((2.0, 1.0, 0.0), 1.0)
    driven.place(flown.truth.body, flown.truth.actuators)
    for _ in range(500):
        command = flown.command  # of the period before, in force in the next
        flown.advance(1)
        driven.drive(command, 1)
    assert driven.truth.body == flown.truth.body
    assert driven.energy == flown.energy


def test_how_far_a_call_flies_does_not_change_the_flight():
    one, many, command = (
        vehicle(up=9.0, airborne=True),
        vehicle(up=9.0, airborne=True),
        Actuators(900.0, 910.0, 0.1, 0.0),
    )
    one.drive(command, 60)
    for _ in range(20):
        many.drive(command, 3)
    assert one.truth == many.truth
    assert list(one.avionics.instruments.last.flat) == list(many.avionics.instruments.last.flat)


def test_what_is_warmed_up_has_not_moved():
    driven = vehicle()
    before = driven.truth
    driven.warm_up()
    assert (driven.truth, driven.periods) == (before, 0)


def test_standing_it_feels_its_weight_along_the_nose_and_sees_where_it_is():
    seen = vehicle(north=2.0, west=-3.0).drive(None, 50)
    assert seen.force == pytest.approx((9.81, 0.0, 0.0), abs=0.4)  # FRD: the nose is up
    assert seen.rates == pytest.approx((0.0, 0.0, 0.0), abs=0.05)
    assert seen.position == pytest.approx((2.0, 3.0, -0.108), abs=1e-2)
    assert seen.attitude == pytest.approx((math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0), abs=1e-6)


def test_a_step_tells_the_mean_of_its_inertial_readings():
    one, many = vehicle(), vehicle()
    parts = [many.drive(None, 1) for _ in range(4)]
    mean = [sum(seen.force[axis] for seen in parts) / 4 for axis in range(3)]
    assert one.drive(None, 4).force == pytest.approx(mean, abs=1e-9)


def test_readings_come_at_their_rates_and_late():
    driven, times = vehicle(), {"field": [], "height": [], "airspeed": [], "fix": [], "pose": []}
    for _ in range(500):
        seen = driven.drive(None, 1)
        for name in times:
            times[name] += [seen.time] if getattr(seen, name) is not None else []
    counts = [len(times[name]) for name in ("field", "height", "airspeed", "fix")]
    assert counts == pytest.approx([50, 50, 50, 9], abs=2)
    assert 190 <= len(times["pose"]) <= 200
    assert times["fix"][0] == pytest.approx(0.1 + 0.12, abs=0.05)
    assert all(after > before for before, after in pairwise(times["fix"]))


def test_an_instrument_that_is_off_tells_nothing():
    driven = vehicle()
    driven.avionics.instruments.failures[GNSS] = OFF
    assert all(driven.drive(None, 10).fix is None for _ in range(50))


def test_without_a_command_the_motors_stop_and_with_one_they_turn():
    driven = vehicle()
    driven.drive(Actuators(800.0, 800.0, 0.2, -0.2), 100)
    assert driven.truth.actuators == pytest.approx((800.0, 800.0, 0.2, -0.2), rel=0.03)
    driven.drive(None, 500)
    assert driven.truth.actuators == pytest.approx((0.0, 0.0, 0.0, 0.0), abs=1e-3)


def test_back_at_its_start_it_is_whole_and_its_time_goes_on():
    driven = vehicle(up=8.0, airborne=True)
    driven.drive(None, 1500)
    assert driven.crash is not None
    driven.restart()
    assert driven.crash is None
    assert driven.truth.body.position.z == 8.0
    assert driven.drive(None, 1).time == pytest.approx(3.002)
