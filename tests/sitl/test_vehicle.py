"""The whole vehicle: reproducible to the bit, however it is stepped, and the report's flights."""

import math

import numpy as np
import pytest

from sitl.airframe import load
from sitl.autopilot.guidance import Setpoint
from sitl.flow import flow
from sitl.hybrid.supervisor import Law
from sitl.studies.report import SCENARIOS
from sitl.studies.scenario import fly
from sitl.vehicle import DivergedError, Start, Tuning, Vehicle

AIRFRAME = load("nominal").parameters


def vehicle(seed=1, gusts=1.0):
    made = Vehicle(AIRFRAME, seed=seed, start=Start(up=50.0, airborne=True))
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    made.set_wind((1.0, 0.5, 0.0), gusts)
    made.set_target(Setpoint((12.0, 5.0, 52.0), 0.5, 3.0))
    return made


def test_one_seed_is_one_flight_however_it_is_stepped():
    whole, pieces = vehicle(), vehicle()
    whole.advance(2000)
    for ticks in (1, 7, 492, 500, 3, 997):
        pieces.advance(ticks)
    assert whole.plant.tobytes() == pieces.plant.tobytes()
    assert whole.memory.tobytes() == pieces.memory.tobytes()
    assert whole.jumps == pieces.jumps


def test_another_seed_is_another_flight_only_in_gusts():
    def end(seed, gusts):
        flown = vehicle(seed, gusts)
        flown.advance(500)
        return flown.plant[:13].tobytes()

    assert end(1, 1.0) != end(2, 1.0)
    assert end(1, 0.0) == end(2, 0.0)


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_scenario_of_the_report_holds_all_its_figures(name):
    track = fly(SCENARIOS[name])
    missed = [f"{f.name} = {f.value:.3f} {f.unit}" for f in SCENARIOS[name].figures(track) if not f.holds]
    assert not missed


def test_entering_a_law_does_not_step_what_it_commands():
    """The reset maps: at a jump, the commands of the new law start near those in force."""
    flown = vehicle(gusts=0.0)
    for _ in range(20_000):
        before = flown.command.copy()
        count = len(flown.jumps)
        flown.advance(1)
        if len(flown.jumps) > count:
            flown.advance(1)
            assert np.abs(flown.command[:2] - before[:2]).max() < 120.0
            break
    assert flown.jumps


def test_energy_by_law_adds_up_to_the_whole():
    flown = vehicle()
    flown.advance(6000)
    assert sum(flown.energy_by_law.values()) == pytest.approx(flown.energy)
    assert flown.energy_by_law[Law.HOVER_ZERO_MOMENT] > 0.0


def test_numbers_that_are_none_end_the_flight_with_law_and_step():
    flown = vehicle()
    flown.plant[4] = math.nan
    with pytest.raises(DivergedError, match="HOVER_ZERO_MOMENT at step 10"):
        flown.advance(10)


def test_thresholds_the_wrong_way_round_make_no_chatter():
    """Parameters refuse them; a vehicle that is built with them keeps its law where both guards would hold."""
    flown = Vehicle(AIRFRAME, start=Start(up=50.0, airborne=True), tuning=Tuning(v_enter=100.0, v_leave=50.0))
    flown.begin_flight(Law.HOVER_LINEAR)
    flown.set_target(Setpoint((7.0, 0.0, 50.0), 0.0, 3.0))
    flown.advance(10)
    assert 50.0 < flown.lyapunov < 100.0
    assert flown.jumps == []


def test_a_wind_in_whole_numbers_compiles_nothing_in_flight():
    flown = vehicle()
    flown.advance(1)
    compiled = list(getattr(flow, "signatures", ()))  # a plain function where compiling is off
    flown.set_wind((3, 0, 0))
    flown.advance(1)
    assert list(getattr(flow, "signatures", ())) == compiled
