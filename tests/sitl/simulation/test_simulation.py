"""The whole vehicle in time: what it is told, what is seen of it, and how a flight ends that cannot go on."""

import math

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law, Limit
from sitl.control.reference import along, hover_at, leg
from sitl.errors import SitlError
from sitl.model.airframe_files import load
from sitl.model.battery import shaft_power
from sitl.model.quaternions import hover
from sitl.model.state import Actuators, Body
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.simulation import loop
from sitl.simulation.flight_errors import DivergedError
from sitl.simulation.simulation import Simulation
from sitl.simulation.situation import holds
from sitl.simulation.start import Start, whole_periods
from sitl.supervisor import guards
from tests.support.flights.started_simulation import NOMINAL, UP, in_forward_flight, vehicle
from tests.support.flights.tunings import BY_REPORT

FEATHER = NOMINAL._replace(J2=1e-9)  # turns faster than the steps can follow


# Time


def test_commands_are_in_force_one_period_after_they_were_computed():
    flown = vehicle(gusts=0.0)
    flown.place(flown.truth.body, Actuators(700.0, 700.0, 0.1, 0.1))
    flown.advance(0)
    computed = []
    for _ in range(3):
        before = flown.truth.actuators
        flown.advance(1)
        computed.append(flown.command)
        moved = flown.truth.actuators.left_elevon - before.left_elevon
        if len(computed) == 1:
            assert moved == 0.0  # the first period flies what was in force
        elif len(computed) == 2:
            assert math.copysign(1.0, moved) == math.copysign(1.0, computed[0].left_elevon - before.left_elevon)
            assert moved != 0.0


@pytest.mark.parametrize("seconds", [0.003, 1e-4, -0.002, 0.0021])
def test_a_time_that_is_no_whole_number_of_periods_is_refused(seconds):
    with pytest.raises(SitlError, match="whole number of control periods"):
        whole_periods(seconds)


def test_times_are_counted_in_periods():
    flown = vehicle()
    flown.step(1.234)
    assert flown.periods == 617
    assert flown.time == pytest.approx(617 * PERIOD)
    with pytest.raises(SitlError, match="whole multiple"):
        flown.record(1.0, 50.0)


def test_the_limits_are_those_of_the_last_call():
    flown = vehicle(gusts=0.0)
    flown.place(flown.truth.body, Actuators(690.0, 690.0, 0.5, -0.5))
    flown.advance(20)
    assert flown.limits & (Limit.ELEVON_LEFT_RATE | Limit.ELEVON_RIGHT_RATE)
    flown.step(4.0)
    flown.advance(1)
    assert flown.limits == 0


# Energy


def test_energy_by_law_adds_up_to_the_whole():
    flown = in_forward_flight()
    flown.advance(6000)
    assert sum(flown.energy_by_law.values()) == pytest.approx(flown.energy)
    assert len(flown.jumps) > 2
    assert {law for law, energy in flown.energy_by_law.items() if energy > 0.0} == {
        jump.source for jump in flown.jumps if jump.time > 0.0
    } | {flown.law}


def test_energy_is_the_sum_of_the_power():
    flown, total = vehicle(), 0.0
    for _ in range(200):
        flown.advance(1)
        total += flown.power * PERIOD
        assert flown.power == shaft_power(flown.truth.actuators, 0.0, NOMINAL)
    assert flown.energy == pytest.approx(total)


# Flights that cannot go on


def test_numbers_that_are_none_end_the_flight_with_law_and_time():
    flown = vehicle()
    flown.place(flown.truth.body._replace(velocity=Vector(0.0, math.nan, 0.0)))
    with pytest.raises(DivergedError, match=r"HOVER_ZERO_MOMENT at 0\.020 s"):
        flown.advance(10)


def test_a_flight_that_diverges_is_recorded_up_to_there():
    flown = vehicle(airframe=FEATHER, design_model=NOMINAL)
    with pytest.raises(DivergedError) as caught:
        flown.record(5.0, 50.0)
    rows = caught.value.recording
    assert 0 < rows.time.size < 250
    assert np.isfinite(rows.position[:-1]).all()
    assert rows.position[0] == pytest.approx((0.0, 0.0, UP))
    assert flown.time < 5.0


def test_thresholds_the_wrong_way_round_make_no_chatter():
    """Parameters refuse them; a vehicle that is built with them keeps its law where both guards would hold."""
    start = Start(up=50.0, airborne=True)
    flown = Simulation(NOMINAL, start=start, tuning=BY_REPORT._replace(v_enter=100.0, v_leave=50.0))
    flown.begin_flight(Law.HOVER_LINEAR)
    flown.reference = hover_at((7.0, 0.0, 50.0), 0.0)
    flown.advance(10)
    assert 50.0 < flown.v_hover < 100.0
    assert flown.jumps == []


# What it is told


def test_a_wind_in_whole_numbers_compiles_nothing_in_flight():
    flown = vehicle()
    flown.advance(1)
    compiled = list(getattr(loop.fly, "signatures", ()))  # a plain function where compiling is off
    flown.set_wind((3, 0, 0), 1)
    flown.reference = hover_at((1, 2, 50), 0, 2)
    flown.place(Body(Vector(1, 2, 50), Vector(0, 0, 0), hover(0.0), Vector(0, 0, 0)), Actuators(690, 690, 0, 0))
    flown.advance(1)
    assert list(getattr(loop.fly, "signatures", ())) == compiled


def test_a_place_is_taken_with_the_controller_kept():
    flown = vehicle()
    flown.step(1.0)
    before = flown.flight
    body = Body(Vector(1.0, 2.0, 40.0), Vector(0.1, 0.0, 0.0), hover(0.3), Vector(0.0, 0.1, 0.0))
    flown.place(body)
    assert flown.truth.body == body
    assert flown.truth.actuators == before.plant.actuators
    assert flown.flight.controller == before.controller
    assert flown.estimate.position == body.position
    assert flown.estimate.wind == before.estimate.wind
    assert not flown.estimate.on_ground


def test_beginning_elsewhere_goes_on_in_time_energy_and_jumps_and_forgets_the_rest():
    flown = vehicle()
    flown.step(2.0)
    energy, time, jumps = flown.energy, flown.time, len(flown.jumps)
    flown.begin(Start(north=5.0, heading=1.0))
    assert (flown.energy, flown.time, len(flown.jumps)) == (energy, time, jumps)
    assert flown.law is Law.LANDED
    assert not flown.armed
    assert not flown.flying
    assert flown.wind_estimate == Vector(0.0, 0.0, 0.0)
    assert flown.reference == hover_at(flown.truth.body.position, 1.0)
    assert flown.estimate.on_ground


def test_what_is_seen_of_it_follows_what_it_is_told_at_once():
    flown = vehicle()
    assert holds(flown, guards.armed)
    flown.armed = False
    assert not holds(flown, guards.armed)
    flown.armed = True
    near = flown.v_hover
    flown.reference = hover_at((30.0, 0.0, UP), 0.0)
    assert flown.v_hover > near
    flown.begin(Start())
    assert not holds(flown, guards.flight_requested)
    flown.flying = True
    assert holds(flown, guards.flight_requested)


def test_an_airframe_without_trims_is_asked_for_no_forward_flight():
    flown = vehicle(airframe=load("published").parameters)
    flown.reference = along(flown.reference, leg((0.0, 0.0, UP), (90.0, 0.0, UP), 15.0), 0.0)
    assert not flown.reference.forward


def test_other_parameters_are_flown_from_the_next_period_on():
    flown, same = vehicle(gusts=0.0), vehicle(gusts=0.0)
    for other in (flown, same):
        other.step(1.0)
    flown.retune(BY_REPORT._replace(kpp=3.0))
    assert flown.flight == same.flight
    for other in (flown, same):
        other.reference = hover_at((30.0, 0.0, UP), 0.0)
        other.step(0.1)
    assert flown.truth != same.truth
