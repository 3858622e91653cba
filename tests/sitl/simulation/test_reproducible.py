"""One seed is one flight, to the bit: however it is stepped, looked at and recorded."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.control.reference import along, leg
from sitl.simulation.flight import JumpEntry
from sitl.simulation.situation import holds
from sitl.storage import record_type
from sitl.supervisor import guards
from tests.support.flights.started_simulation import in_forward_flight, standing, state, vehicle

FLOWN = 2600  # periods; a block of draws is 2000 long


@pytest.mark.parametrize("made", [vehicle, standing, in_forward_flight])
@settings(max_examples=12)
@given(stops=st.lists(st.integers(0, FLOWN), max_size=8), diagnostics_rows=st.booleans())
def test_one_seed_is_one_flight_however_it_is_stepped_and_looked_at(made, stops, diagnostics_rows):
    whole, pieces = made(), made()
    whole.advance(FLOWN)
    for stop in sorted({*stops, FLOWN}):
        pieces.advance(stop - pieces.periods)
        if diagnostics_rows:
            pieces.sample()
            holds(pieces, guards.armed)
    assert state(pieces) == state(whole)
    assert pieces.energy_by_law == pytest.approx(whole.energy_by_law)


def test_one_period_at_a_time_is_the_same_flight_too():
    whole, pieces = vehicle(), vehicle()
    whole.advance(500)
    for _ in range(500):
        pieces.advance(1)
    assert state(pieces) == state(whole)


def test_recording_does_not_change_the_flight_and_records_it_as_it_is():
    watched, recorded = in_forward_flight(), in_forward_flight()
    rows = recorded.record(4.0, 50.0)
    assert rows.time == pytest.approx(0.02 * np.arange(200))
    for k in range(200):
        watched.advance(0)  # samples are taken after the jumps of their instant
        body = watched.truth.body
        seen = (rows.position[k], rows.velocity[k], rows.attitude[k], rows.rates[k])
        assert tuple(map(tuple, seen)) == body
        assert tuple(rows.actuators[k]) == watched.truth.actuators
        assert (rows.law[k], rows.v_hover[k], rows.energy[k]) == (watched.law, watched.v_hover, watched.energy)
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
    for name in ("time", "position", "attitude", "rates", "actuators", "law", "v_hover", "energy", "wind", "pointing"):
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
