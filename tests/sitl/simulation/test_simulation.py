"""The whole vehicle in time: reproducible to the bit, however it is stepped, looked at and recorded."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect.vocabulary import Law, Limit
from sitl.airframe import load
from sitl.control.reference import along, hover_at, leg
from sitl.errors import SitlError
from sitl.model.plant import shaft_power
from sitl.model.quaternions import hover
from sitl.model.state import Actuators, Body
from sitl.model.vectors import Vector
from sitl.simulation import loop
from sitl.simulation.flight import JumpEntry
from sitl.simulation.simulation import PERIOD, DivergedError, Simulation, Start, Tuning, whole_periods
from sitl.simulation.storage import record_type
from sitl.supervisor import guards

NOMINAL = load("nominal").parameters
FEATHER = NOMINAL._replace(J2=1e-9)  # turns faster than the steps can follow
UP = 50.0
FLOWN = 2600  # periods; a block of draws is 2000 long


def vehicle(seed=1, gusts=1.0, airframe=NOMINAL, design_model=None):
    made = Simulation(airframe, seed=seed, start=Start(up=UP, airborne=True), design_model=design_model)
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    made.set_wind((1.0, 0.5, 0.0), gusts)
    made.reference = hover_at((2.0, 1.0, UP), 0.5, 3.0)
    return made


def standing():
    made = Simulation(NOMINAL)
    made.armed = made.flying = True
    made.reference = hover_at((0.0, 0.0, 2.0), 0.0)
    return made


def on_the_wing():
    made = vehicle()
    made.reference = along(made.reference, leg((0.0, 0.0, UP), (300.0, 0.0, UP), 15.0), 0.0)
    return made


def state(simulation):
    """Everything, to the bit, but the limits met in the last call."""
    record = simulation._flights.copy()
    record["limits"] = 0
    return simulation.flight._replace(limits=0), simulation.jumps, record.tobytes()


# One seed is one flight


@pytest.mark.parametrize("made", [vehicle, standing, on_the_wing])
@settings(max_examples=12)
@given(stops=st.lists(st.integers(0, FLOWN), max_size=8), looks=st.booleans())
def test_one_seed_is_one_flight_however_it_is_stepped_and_looked_at(made, stops, looks):
    whole, pieces = made(), made()
    whole.advance(FLOWN)
    for stop in sorted({*stops, FLOWN}):
        pieces.advance(stop - pieces.periods)
        if looks:
            pieces.sample()
            pieces.holds(guards.armed)
    assert state(pieces) == state(whole)
    assert pieces.energy_by_law == pytest.approx(whole.energy_by_law)


def test_one_period_at_a_time_is_the_same_flight_too():
    whole, pieces = vehicle(), vehicle()
    whole.advance(500)
    for _ in range(500):
        pieces.advance(1)
    assert state(pieces) == state(whole)


def test_recording_does_not_change_the_flight_and_records_it_as_it_is():
    watched, recorded = on_the_wing(), on_the_wing()
    rows = recorded.record(4.0, 50.0)
    assert rows.time == pytest.approx(0.02 * np.arange(200))
    for k in range(200):
        watched.advance(0)  # samples are taken after the jumps of their instant
        body = watched.truth.body
        seen = (rows.position[k], rows.velocity[k], rows.attitude[k], rows.rates[k])
        assert tuple(map(tuple, seen)) == body
        assert tuple(rows.actuators[k]) == watched.truth.actuators
        assert (rows.law[k], rows.v_hover[k], rows.energy[k]) == (watched.law, watched.lyapunov, watched.energy)
        assert tuple(rows.wind[k]) == watched.wind_estimate
        assert tuple(rows.reference[k]) == watched.reference.position
        watched.advance(10)
    assert state(recorded) == state(watched)
    assert rows.jumps == tuple(watched.jumps)


def test_a_sample_is_what_a_recording_begins_with():
    flown = vehicle()
    flown.advance(100)
    sample = flown.sample()
    rows = flown.record(0.02, 50.0)
    for name in ("time", "position", "attitude", "rates", "actuators", "law", "v_hover", "energy", "wind", "guide"):
        assert np.array_equal(getattr(sample, name), getattr(rows, name)), name


def test_more_jumps_than_a_call_can_note_are_the_same_jumps():
    """From the ground over three laws to the wing, its jumps noted one by one."""
    few, many = standing(), standing()
    few._jump_log = np.zeros(1, record_type(JumpEntry))
    for flown in (few, many):
        flown.advance(4000)
        flown.reference = along(flown.reference, leg((0.0, 0.0, 2.0), (300.0, 0.0, 30.0), 15.0), 0.0)
        flown.advance(4000)
    assert len(many.jumps) > 4
    assert state(few) == state(many)


def test_another_seed_is_another_flight_only_in_gusts():
    def end(seed, gusts):
        flown = vehicle(seed, gusts)
        flown.advance(500)
        return flown.truth

    assert end(1, 1.0) != end(2, 1.0)
    assert end(1, 0.0) == end(2, 0.0)


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
    flown = on_the_wing()
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
        assert flown.power == shaft_power(flown.truth.actuators, NOMINAL)
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
    flown = Simulation(NOMINAL, start=start, tuning=Tuning(v_enter=100.0, v_leave=50.0))
    flown.begin_flight(Law.HOVER_LINEAR)
    flown.reference = hover_at((7.0, 0.0, 50.0), 0.0)
    flown.advance(10)
    assert 50.0 < flown.lyapunov < 100.0
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
    assert flown.holds(guards.armed)
    flown.armed = False
    assert not flown.holds(guards.armed)
    flown.armed = True
    near = flown.lyapunov
    flown.reference = hover_at((30.0, 0.0, UP), 0.0)
    assert flown.lyapunov > near
    flown.begin(Start())
    assert not flown.holds(guards.flying)
    flown.flying = True
    assert flown.holds(guards.flying)


def test_an_airframe_without_trims_is_asked_for_no_forward_flight():
    flown = vehicle(airframe=load("published").parameters)
    flown.reference = along(flown.reference, leg((0.0, 0.0, UP), (90.0, 0.0, UP), 15.0), 0.0)
    assert not flown.reference.forward


def test_other_parameters_are_flown_from_the_next_period_on():
    flown, same = vehicle(gusts=0.0), vehicle(gusts=0.0)
    for other in (flown, same):
        other.step(1.0)
    flown.retune(Tuning(kpp=3.0))
    assert flown.flight == same.flight
    for other in (flown, same):
        other.reference = hover_at((30.0, 0.0, UP), 0.0)
        other.step(0.1)
    assert flown.truth != same.truth
