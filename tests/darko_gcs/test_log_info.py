"""``darko-gcs log info``: what is said is what was flown."""

import argparse
import json
import math

import numpy as np
import pytest

from darko_gcs.commands import log_info
from darko_gcs.flight_summary import enum_name, summarise
from darko_gcs.log_report import as_json, as_text
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, Law, Way
from protocol.errors import FileError
from protocol.modes import Mode, custom_mode
from protocol.tlog import TlogReader
from tests.support.darko_messages import energy, hybrid_state
from tests.support.logs import T0, bare, log_of, quadplane_log, record, unknown_frame

ARMED = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_SAFETY_ARMED


def beat(mode, base=mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED):
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_VTOL_DUOROTOR, mavlink.MAV_AUTOPILOT_PX4, base, custom_mode(mode), 4, 3
    )


def local(north, height, speed):
    return mavlink.MAVLink_local_position_ned_message(0, north, 0.0, -height, speed, 0.0, 0.0)


def law(flown, second):
    return hybrid_state(1000 * second, flown)


def jump(number, v):
    return mavlink.MAVLink_darko_jump_message(number, number, v, 2, 1, 1, b"calm")


def text(words, number=0, chunk=0):
    return mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_WARNING, words, number, chunk)


STATION = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)
FLIGHT = [  # one a second
    beat(Mode.HOLD),
    local(50.0, 0.0, 0.0),  # carried to its place, not flown there
    beat(Mode.TAKEOFF, ARMED),
    local(0.0, 0.0, 0.0),
    local(3.0, 4.0, 1.5),
    law(Law.HOVER_ZERO_MOMENT, 5),
    jump(1, 0.25),
    law(Law.HOVER_LINEAR, 7),
    law(Law.HOVER_LINEAR, 8),
    local(3.0, 9.0, 0.5),
    beat(Mode.MISSION, ARMED),
    text(b"a long wa", 7, 0),
    text(b"rning", 7, 1),
    jump(2, math.nan),
    beat(Mode.LAND),
    text(b"landed\x1b[2J"),
]


def flight_log():
    return log_of([*map(bare, FLIGHT), bare(STATION, system=255, component=190)], step=1_000_000)


@pytest.fixture(scope="module")
def summary():
    return summarise(TlogReader(flight_log() + b"\x07" * 30))


def test_the_vehicle_is_named_by_its_heartbeat_and_stations_are_no_vehicles(summary):
    (flight,) = summary.flights
    assert (flight.system, flight.component, flight.type, flight.autopilot) == (1, 1, "VTOL_DUOROTOR", "PX4")
    assert summary.stations == ((255, 190),)


def test_modes_and_armed_periods_last_until_the_next_heartbeat_that_differs(summary):
    (flight,) = summary.flights
    periods = [(mode.name, mode.start, mode.end) for mode in flight.modes]
    assert periods == [("HOLD", 0, 2), ("TAKEOFF", 2, 10), ("MISSION", 10, 14), ("LAND", 14, 16)]
    assert [(armed.start, armed.end) for armed in flight.armed] == [(2, 14)]


def test_distance_counts_only_what_is_flown_armed(summary):
    (flight,) = summary.flights
    assert flight.distance == pytest.approx(5.0)  # 3-4-5 up, then a gap too long to guess across
    assert flight.height == pytest.approx(9.0)
    assert flight.speed == pytest.approx(1.5)


def test_laws_and_jumps_are_those_of_the_wire(summary):
    (flight,) = summary.flights
    assert flight.laws == {"HOVER_LINEAR": pytest.approx(1.0), "HOVER_ZERO_MOMENT": pytest.approx(2.0)}
    first, second = flight.jumps
    assert (first.time, first.number, first.name, first.v) == (6.0, 1, "calm", 0.25)
    assert (first.law_from, first.law_to, first.reason) == ("HOVER_ZERO_MOMENT", "HOVER_LINEAR", "LYAPUNOV_BELOW")
    assert math.isnan(second.v)


def test_chunks_of_a_text_are_put_together(summary):
    assert [(entry.time, entry.severity, entry.text) for entry in summary.texts][:1] == [
        (11.0, "WARNING", "a long warning")
    ]
    assert len(summary.texts) == 2


def test_counts_and_rates_are_by_message_and_source(summary):
    counts = {(m.name, m.system): (m.count, m.rate) for m in summary.messages}
    assert counts["HEARTBEAT", 1] == (4, pytest.approx(4 / 16))
    assert counts["HEARTBEAT", 255] == (1, pytest.approx(1 / 16))
    assert sum(m.count for m in summary.messages) == summary.records == len(FLIGHT) + 1


def test_a_person_is_told_everything_and_the_terminal_nothing(summary):
    told = as_text(summary, "flight.tlog")
    for line in (
        "flight.tlog: 17 messages in 0:16.0 (",
        "recorded from 2025-10-09 08:53:20 UTC",
        "other stations: 255/190",
        "vehicle 1/1: VTOL_DUOROTOR, autopilot PX4",
        "    0:02.0 to 0:10.0  TAKEOFF",
        "    0:02.0 to 0:14.0\n",
        "flown 5.0 m, height up to 9.0 m, speed up to 1.5 m/s",
        "    HOVER_LINEAR             0:01.0        -",
        "    HOVER_ZERO_MOMENT        0:02.0        -",
        "0:06.0 jump 1 calm: HOVER_ZERO_MOMENT -> HOVER_LINEAR, LYAPUNOV_BELOW at V = 0.25",
        "damage: 30 bytes in 1 places belong to no message",
        "1/1 WARNING: landed?[2J",
    ):
        assert line in told
    assert "\x1b" not in told
    assert "a long warning" not in as_text(summary, "flight.tlog", texts=1)
    assert "status texts" not in as_text(summary, "flight.tlog", texts=0)


def test_a_program_is_told_the_same_as_json(summary):
    told = json.loads(as_json(summary, "flight.tlog"))
    assert told["file"] == "flight.tlog"
    assert told["flights"][0]["modes"][1] == {"name": "TAKEOFF", "start": 2.0, "end": 10.0}
    assert told["flights"][0]["jumps"][1]["v"] is None
    assert told["damage"] == [{"offset": len(flight_log()), "length": 30, "what": "no frame where one should start"}]


def test_how_often_and_how_far_the_recording_clock_went_back_is_said():
    times = (7200, 7201, 3600, 3601, 3591, 3592)  # [s]
    log = b"".join(record(T0 + 1_000_000 * time, bare(text(b"x"))) for time in times)
    summary = summarise(TlogReader(log))
    assert (summary.clock_steps, summary.clock_back, summary.duration) == (2, 3601.0, 3.0)
    assert "the recording clock went back 2 times, by up to 1:00:01.0" in as_text(summary, "x.tlog")


def test_what_cannot_be_verified_or_believed_is_said():
    frames = [record(5, bare(text(b"x"))), record(2, unknown_frame(77_000, b"ab")), record(9, bare(text(b"y")))]
    told = as_text(summarise(TlogReader(b"".join(frames))), "x.tlog")
    assert "recorded on a simulation's clock" in told
    assert "1 messages are not in the dialect: their checksums cannot be verified" in told
    assert "the recording clock went back once, by 0:00.0" in told
    assert "UNKNOWN_77000" in told
    assert "no damage" in told


def test_without_a_local_position_the_global_one_tells_and_no_fix_is_no_place():
    def at(lat, lon, height):
        return mavlink.MAVLink_global_position_int_message(0, lat, lon, 0, height, 300, 400, 0, 0)

    messages = [beat(Mode.HOLD, ARMED), at(0, 0, 0), at(435648000, 1490000000, 0), at(435657993, 1490000000, 7000)]
    (flight,) = summarise(TlogReader(log_of(map(bare, messages)))).flights
    assert flight.distance == pytest.approx(math.hypot(111.12, 7.0), rel=5e-3)
    assert flight.height == pytest.approx(7.0)
    assert flight.speed == pytest.approx(5.0)


def test_a_vehicle_that_tells_no_position_has_no_figures():
    (flight,) = summarise(TlogReader(log_of([bare(beat(Mode.HOLD))]))).flights
    assert (flight.distance, flight.height, flight.speed) == (None, None, None)
    assert flight.armed == ()
    assert "armed: never" in as_text(summarise(TlogReader(log_of([bare(beat(Mode.HOLD))]))), "x")


def test_nan_positions_do_not_spoil_the_figures():
    messages = [beat(Mode.HOLD, ARMED), local(math.nan, math.nan, math.nan), local(0.0, 1.0, 2.0)]
    (flight,) = summarise(TlogReader(log_of(map(bare, messages)))).flights
    assert np.isfinite([flight.distance, flight.height, flight.speed]).all()


def vtol(state):
    return mavlink.MAVLink_extended_sys_state_message(state, mavlink.MAV_LANDED_STATE_IN_AIR)


def off(metres):
    return mavlink.MAVLink_nav_controller_output_message(0, 0, 0, 0, 0, 0, 0, metres)


def decision(seq, forward_time, way, reason):
    return mavlink.MAVLink_darko_decision_message(
        0, 100.0, 10.0, 0.0, 0.0, 29.25, 4983.0, forward_time, 1757.0, seq, way, reason
    )


ENVELOPE = [  # one a second
    beat(Mode.HOLD),
    off(50.0),  # disarmed: no flight
    beat(Mode.MISSION, ARMED),
    vtol(mavlink.MAV_VTOL_STATE_MC),
    energy(100.0, {Law.HOVER_LINEAR: 100.0}),
    decision(2, 12.125, Way.FORWARD, DecisionReason.ENERGY),
    law(Law.TO_FORWARD, 6),
    vtol(mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW),
    off(3.0),
    law(Law.FORWARD_LINEAR, 9),
    vtol(mavlink.MAV_VTOL_STATE_FW),
    energy(1500.0, {Law.HOVER_LINEAR: 150.0, Law.TO_FORWARD: 900.0, Law.FORWARD_LINEAR: 450.0}),
    off(-4.0),
    off(math.nan),
    decision(0xFFFF, math.inf, Way.HOVER, DecisionReason.NO_TRIM),
    energy(5.0, {Law.HOVER_LINEAR: 5.0}),  # restarted
]


@pytest.fixture(scope="module")
def envelope():
    return summarise(TlogReader(log_of(map(bare, ENVELOPE), step=1_000_000)))


def test_energy_is_counted_by_law_and_a_restart_takes_none_back(envelope):
    (flight,) = envelope.flights
    assert flight.energy == {"HOVER_LINEAR": 50.0, "TO_FORWARD": 900.0, "FORWARD_LINEAR": 450.0}
    assert "    TO_FORWARD               0:03.0      900 J\n" in as_text(envelope, "x")


def test_transitions_are_periods_of_their_own(envelope):
    (flight,) = envelope.flights
    assert [(p.name, p.start, p.end) for p in flight.vtol] == [
        ("MC", 3, 7),
        ("TRANSITION_TO_FW", 7, 10),
        ("FW", 10, 15),
    ]
    assert "    0:07.0 to 0:10.0  TRANSITION_TO_FW\n" in as_text(envelope, "x")


def test_the_path_is_judged_by_what_was_flown_armed(envelope):
    (flight,) = envelope.flights
    assert flight.cross_track_rms == pytest.approx(math.sqrt(12.5))
    assert flight.cross_track_max == pytest.approx(4.0)
    assert "off the path 3.5 m rms, at most 4.0 m" in as_text(envelope, "x")


def test_decisions_are_told_with_both_ways(envelope):
    (flight,) = envelope.flights
    first, second = flight.decisions
    assert (first.time, first.seq, first.way, first.reason) == (5.0, 2, "FORWARD", "ENERGY")
    assert (second.seq, second.way, second.reason, second.forward_time) == (None, "HOVER", "NO_TRIM", math.inf)
    told = as_text(envelope, "x")
    both = "(hover 29.2 s 4983 J, forward 12.1 s 1757 J)"
    assert f"0:05.0 leg to 2, 100 m, climb +10 m: FORWARD, ENERGY {both}" in told
    assert "leg, 100 m, climb +10 m: HOVER, NO_TRIM (hover 29.2 s 4983 J, forward impossible)" in told
    assert json.loads(as_json(envelope, "x"))["flights"][0]["decisions"][1]["forward_time"] is None


def test_a_vehicle_that_is_no_vtol_has_no_transitions(summary):
    (flight,) = summary.flights
    assert (flight.vtol, flight.decisions, flight.cross_track_rms) == ((), (), None)
    assert "vtol" not in as_text(summary, "x")


def test_a_value_outside_its_enum_is_its_number():
    assert enum_name("MAV_TYPE", 222) == "222"


def arguments(*words):
    parser = argparse.ArgumentParser()
    log_info.configure(parser)
    return parser.parse_args(words)


def test_the_command_prints_text_or_json(tmp_path, capsys):
    path = tmp_path / "flight.tlog"
    path.write_bytes(flight_log())
    assert log_info.run(arguments(str(path))) == 0
    assert capsys.readouterr().out.startswith(f"{path}: 17 messages")
    assert log_info.run(arguments(str(path), "--json")) == 0
    assert json.loads(capsys.readouterr().out)["records"] == 17


def test_the_command_leaves_a_bad_file_to_its_caller(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("no log\n")
    with pytest.raises(FileError, match=r"notes\.txt: not a telemetry log: it is a text file"):
        log_info.run(arguments(str(path)))


def test_another_autopilots_flight_is_summed_up():
    summary = summarise(TlogReader(quadplane_log()))
    (flight,) = summary.flights
    assert (summary.records, summary.unknown, summary.damage) == (23894, 6857, ())
    assert (flight.type, flight.autopilot) == ("FIXED_WING", "ARDUPILOTMEGA")
    assert [mode.name for mode in flight.modes] == ["QLOITER", "CIRCLE", "GUIDED", "QLAND"]
    assert summary.texts[-1].text == "Land complete"
    assert summary.start_usec > T0 - 10 * 365 * 86400 * 10**6


@pytest.mark.filterwarnings("error")
def test_numbers_that_are_none_are_summarised_without_a_warning():
    odd = (math.inf, math.inf, math.nan, 3.4e38, -3.4e38)
    energies = [energy(x, dict.fromkeys(Law, x), power=x) for x in odd]
    messages = [beat(Mode.HOLD, ARMED), *(local(x, x, x) for x in odd), *energies, beat(Mode.LAND)]
    assert len(summarise(TlogReader(log_of(map(bare, messages)))).flights) == 1
