"""The summary of a log has the numbers of the flight in it."""

import math

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.flight_log.flight_summary import enum_name, summarise
from protocol.names import Mode
from protocol.tlog import TlogReader
from tests.support.gcs.messages import text
from tests.support.gcs.sample_logs import FORWARD_FLIGHT, HOVER_FLIGHT, at, beat, hover_log, log_of_messages
from tests.support.logs import T0, bare, quadplane_log, record
from tests.support.vehicle.darko_messages import energy


@pytest.fixture(scope="module")
def summary():
    return summarise(TlogReader(hover_log() + b"\x07" * 30))


def summary_of(messages):
    return summarise(TlogReader(log_of_messages(messages)))


def test_a_vehicle_is_named_by_its_heartbeat_and_stations_are_no_vehicles(summary):
    (flight,) = summary.flights
    assert (flight.system, flight.component, flight.type, flight.autopilot) == (1, 1, "VTOL_DUOROTOR", "PX4")
    assert summary.stations == ((255, 190),)


def test_modes_and_armed_periods_last_until_the_next_heartbeat_that_differs(summary):
    (flight,) = summary.flights
    periods = [(mode.name, mode.start, mode.end) for mode in flight.modes]
    assert periods == [("HOLD", 0, 2), ("TAKEOFF", 2, 10), ("MISSION", 10, 14), ("LAND", 14, 16)]
    assert [(armed.start, armed.end) for armed in flight.armed] == [(2, 14)]


def test_distance_counts_only_while_armed(summary):
    (flight,) = summary.flights
    assert flight.distance == pytest.approx(5.0)  # a 3-4-5 triangle, then a gap too long to count
    assert flight.height == pytest.approx(9.0)
    assert flight.speed == pytest.approx(1.5)


def test_laws_and_jumps_are_those_of_the_messages(summary):
    (flight,) = summary.flights
    assert flight.laws == {"HOVER_LINEAR": pytest.approx(1.0), "HOVER_ZERO_MOMENT": pytest.approx(2.0)}
    first, second = flight.jumps
    assert (round(first.time, 6), first.number, first.name, first.v) == (6.0, 1, "calm", 0.25)
    assert (first.law_from, first.law_to, first.reason) == ("HOVER_ZERO_MOMENT", "HOVER_LINEAR", "LYAPUNOV_BELOW")
    assert math.isnan(second.v)


def test_chunks_of_a_text_are_joined(summary):
    first = summary.texts[0]
    assert (first.time, first.severity, first.text) == (11.0, "WARNING", "a long warning")
    assert len(summary.texts) == 2


def test_messages_are_counted_by_kind_and_source(summary):
    counts = {(m.name, m.system): (m.count, m.rate) for m in summary.messages}
    assert counts["HEARTBEAT", 1] == (4, pytest.approx(4 / 16))
    assert counts["HEARTBEAT", 255] == (1, pytest.approx(1 / 16))
    assert sum(m.count for m in summary.messages) == summary.records == len(HOVER_FLIGHT) + 1


def test_records_are_counted_by_version_of_their_frames(summary):
    assert (summary.version_1, summary.version_2, summary.signed, summary.unknown) == (0, summary.records, 0, 0)


def test_a_clock_that_goes_forward_has_no_steps(summary):
    assert (summary.clock_steps, summary.clock_back) == (0, 0.0)


def test_backward_steps_of_the_recording_clock_are_counted_and_measured():
    times = (7200, 7201, 3600, 3601, 3591, 3592)  # [s]
    log = b"".join(record(T0 + 1_000_000 * time, bare(text(b"x"))) for time in times)
    summary = summarise(TlogReader(log))
    assert (summary.clock_steps, summary.clock_back, summary.duration) == (2, 3601.0, 3.0)


def test_without_local_positions_the_global_ones_count_but_not_those_without_a_fix():
    def fix(lat, lon, height):
        return mavlink.MAVLink_global_position_int_message(
            time_boot_ms=0, lat=lat, lon=lon, alt=0, relative_alt=height, vx=300, vy=400, vz=0, hdg=0
        )

    fixes = [fix(0, 0, 0), fix(435648000, 1490000000, 0), fix(435657993, 1490000000, 7000)]
    (flight,) = summary_of([beat(Mode.HOLD, armed=True), *fixes]).flights
    assert flight.distance == pytest.approx(math.hypot(111.12, 7.0), rel=5e-3)
    assert flight.height == pytest.approx(7.0)
    assert flight.speed == pytest.approx(5.0)


@pytest.mark.parametrize(("lat", "lon"), [(0, 1_490_000_000), (435_648_000, 0)])
def test_places_on_the_equator_and_on_the_prime_meridian_are_fixes(lat, lon):
    fixes = [mavlink.MAVLink_global_position_int_message(0, lat + k, lon, 0, 0, 0, 0, 0, 0) for k in (0, 10_000)]
    (flight,) = summary_of([beat(Mode.HOLD, armed=True), *fixes]).flights
    assert flight.distance == pytest.approx(111.2, abs=0.1)


def test_without_positions_there_is_no_distance_height_or_speed():
    (flight,) = summary_of([beat(Mode.HOLD)]).flights
    assert (flight.distance, flight.height, flight.speed) == (None, None, None)
    assert flight.armed == ()


def test_nan_positions_are_ignored():
    (flight,) = summary_of([beat(Mode.HOLD, armed=True), at(math.nan, math.nan, math.nan), at(0.0, 1.0, 2.0)]).flights
    assert np.isfinite([flight.distance, flight.height, flight.speed]).all()


@pytest.fixture(scope="module")
def forward():
    (flight,) = summary_of(FORWARD_FLIGHT).flights
    return flight


def test_energy_is_counted_by_law_also_over_a_restart(forward):
    assert forward.energy == {"HOVER_LINEAR": 50.0, "TO_FORWARD": 900.0, "FORWARD_LINEAR": 450.0}


def test_transitions_are_periods_of_their_own(forward):
    periods = [(p.name, p.start, p.end) for p in forward.vtol]
    assert periods == [("MC", 3, 7), ("TRANSITION_TO_FW", 7, 10), ("FW", 10, 15)]


def test_the_cross_track_error_counts_only_while_armed(forward):
    assert forward.cross_track_rms == pytest.approx(math.sqrt(12.5))
    assert forward.cross_track_max == pytest.approx(4.0)


def test_decisions_have_names_and_times(forward):
    first, second = forward.decisions
    assert (first.time, first.seq, first.way, first.reason) == (5.0, 2, "FORWARD", "ENERGY")
    assert (second.seq, second.way, second.reason, second.forward_time) == (None, "HOVER", "NO_TRIM", math.inf)


def test_a_vehicle_without_vtol_states_has_no_transitions(summary):
    (flight,) = summary.flights
    assert (flight.vtol, flight.decisions, flight.cross_track_rms) == ((), (), None)


def test_energy_of_half_a_joule_counts():
    energies = [energy(joules, {Law.HOVER_LINEAR: joules}) for joules in (1.0, 1.5)]
    (flight,) = summary_of([beat(Mode.HOLD), *energies]).flights
    assert flight.energy == {"HOVER_LINEAR": 0.5}


def test_a_log_without_length_has_no_rates():
    assert [message.rate for message in summary_of([beat(Mode.HOLD)]).messages] == [0.0]


def test_a_text_names_its_system_and_component():
    frames = [bare(beat(Mode.HOLD)), bare(text(b"ready"), system=7, component=154)]
    (said,) = summarise(TlogReader(b"".join(record(T0, frame) for frame in frames))).texts
    assert (said.system, said.component) == (7, 154)


def test_a_value_outside_its_enum_is_its_number():
    assert enum_name("MAV_TYPE", 222) == "MAV_TYPE 222"


def test_a_real_flight_of_another_autopilot_is_summarised():
    summary = summarise(TlogReader(quadplane_log()))
    (flight,) = summary.flights
    assert (summary.records, summary.unknown, summary.damage) == (23894, 0, ())
    assert (flight.type, flight.autopilot) == ("FIXED_WING", "ARDUPILOTMEGA")
    assert [mode.name for mode in flight.modes] == ["QLOITER", "CIRCLE", "GUIDED", "QLAND"]
    assert summary.texts[-1].text == "Land complete"
    assert summary.start_usec > T0 - 10 * 365 * 86400 * 10**6


@pytest.mark.filterwarnings("error")
def test_infinite_and_nan_numbers_are_summarised_without_a_warning():
    odd = (math.inf, math.inf, math.nan, 3.4e38, -3.4e38)
    energies = [energy(x, dict.fromkeys(Law, x), power=x) for x in odd]
    positions = [at(x, x, x) for x in odd]
    assert len(summary_of([beat(Mode.HOLD, armed=True), *positions, *energies, beat(Mode.LAND)]).flights) == 1


def test_a_slow_flight_close_to_the_ground_has_its_own_speed_and_height():
    (flight,) = summary_of([beat(Mode.HOLD, armed=True), at(0.0, 0.25, 0.5), at(0.1, 0.5, 0.25)]).flights
    assert (flight.height, flight.speed) == (0.5, 0.5)


def test_a_position_that_came_late_is_no_way_back_and_forth():
    """Each metre is flown once; one message in ten comes behind its successor."""
    beat = mavlink.MAVLink_heartbeat_message(20, 12, 128, 0, 4, 3)
    sent = sorted(range(100), key=lambda k: k + 1.5 * (k % 10 == 5))
    places = [mavlink.MAVLink_local_position_ned_message(k * 100, k, 0, 0, 0, 0, 0) for k in sent]
    records = [record(T0 + 100_000 * at, bare(message)) for at, message in enumerate([beat, *places])]
    (flight,) = summarise(TlogReader(b"".join(records))).flights
    assert flight.distance == pytest.approx(99.0)
