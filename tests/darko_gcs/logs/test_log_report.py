"""The summary of a log as text and as JSON."""

import json
import math
from dataclasses import replace

import pytest

from darko_gcs.logs.log_report import summary_as_json, summary_as_text
from protocol.flight_log.flight_summary import summarise
from protocol.flight_log.flown_legs import LoggedLeg
from protocol.names import Mode
from protocol.tlog import TlogReader
from tests.support.gcs.messages import text
from tests.support.gcs.sample_logs import FORWARD_FLIGHT, beat, hover_log, log_of_messages
from tests.support.logs import T0, bare, record, unknown_frame


@pytest.fixture(scope="module")
def summary():
    return summarise(TlogReader(hover_log() + b"\x07" * 30))


@pytest.fixture(scope="module")
def forward():
    return summarise(TlogReader(log_of_messages(FORWARD_FLIGHT)))


def test_the_text_has_every_part_and_no_control_character(summary):
    report = summary_as_text(summary, "flight.tlog")
    for line in (
        "flight.tlog: 17 messages in 0:16.0 (",
        "recorded from 2025-10-09 08:53:20 UTC",
        "no vehicles: 255/190 (stations and others; the one that recorded is among them if it sent)",
        "vehicle 1/1: VTOL_DUOROTOR, DarkO with PX4's modes",
        "    0:02.0 to 0:10.0  TAKEOFF",
        "    0:02.0 to 0:14.0\n",
        "flown 5.0 m, maximum height 9.0 m, maximum speed 1.5 m/s",
        "    hover linear             0:01.0        -",
        "    hover zero-moment        0:02.0        -",
        "0:06.0 jump 1: hover zero-moment to hover linear: V below threshold, V 0.25",
        "damage: 30 bytes outside messages, in 1 place",
        "1/1 WARNING: landed?[2J",
    ):
        assert line in report
    assert "\x1b" not in report
    assert "a long warning" not in summary_as_text(summary, "flight.tlog", texts=1)
    assert "status texts" not in summary_as_text(summary, "flight.tlog", texts=0)
    assert "vtol" not in report


def test_the_json_has_the_same_numbers(summary):
    report = json.loads(summary_as_json(summary, "flight.tlog"))
    assert report["file"] == "flight.tlog"
    assert report["flights"][0]["modes"][1] == {"name": "TAKEOFF", "start": 2.0, "end": 10.0}
    assert report["flights"][0]["jumps"][1]["v"] is None
    assert report["damage"] == [{"offset": len(hover_log()), "length": 30, "what": "no frame where one should start"}]


def test_backward_steps_of_the_recording_clock_are_reported():
    times = (7200, 7201, 3600, 3601, 3591, 3592)  # [s]
    log = b"".join(record(T0 + 1_000_000 * time, bare(text(b"x"))) for time in times)
    report = summary_as_text(summarise(TlogReader(log)), "x.tlog")
    assert "the recording clock went back 2 times, by up to 1:00:01.0" in report


def test_unknown_messages_and_simulated_clocks_are_reported():
    frames = [record(5, bare(text(b"x"))), record(2, unknown_frame(77_000, b"ab")), record(9, bare(text(b"y")))]
    report = summary_as_text(summarise(TlogReader(b"".join(frames))), "x.tlog")
    assert "recorded on a simulation's clock" in report
    assert "messages outside the dialect: 1 (their checksums cannot be verified)" in report
    assert "the recording clock went back once, by 0:00.0" in report
    assert "UNKNOWN_77000" in report
    assert "no damage" in report


def test_a_vehicle_that_was_never_armed_is_reported():
    report = summary_as_text(summarise(TlogReader(log_of_messages([beat(Mode.HOLD)]))), "x")
    assert "armed: never" in report


def test_energy_transitions_and_cross_track_error_have_their_lines(forward):
    report = summary_as_text(forward, "x")
    assert "    front transition         0:03.0      900 J\n" in report
    assert "    0:07.0 to 0:10.0  TRANSITION_TO_FW\n" in report
    assert "cross-track error 3.5 m rms, maximum 4.0 m" in report


def test_decisions_are_reported_with_both_predictions(forward):
    report = summary_as_text(forward, "x")
    both = "(hover 29.2 s 4983 J, forward 12.1 s 1757 J)"
    assert f"0:05.0 leg to 2, 100 m, climb +10 m: forward: less energy {both}" in report
    assert "leg, 100 m, climb +10 m: hover: no trim in transition (hover 29.2 s 4983 J, forward impossible)" in report
    assert json.loads(summary_as_json(forward, "x"))["flights"][0]["decisions"][1]["forward_time"] is None


def test_legs_are_reported_beside_their_bounds(forward):
    leg = LoggedLeg(
        time=5.0,
        seq=2,
        distance=100.0,
        climb=0.0,
        flown_time=9.8,
        flown_energy=1040.0,
        bound_time=7.84,
        bound_energy=800.0,
    )
    through = replace(leg, seq=3, bound_time=math.nan, bound_energy=math.nan)
    report = summary_as_text(replace(forward, flights=(replace(forward.flights[0], legs=(leg, through)),)), "x")
    assert "    0:05.0 leg to 2, 100 m: 9.8 s of 7.8: 1.25, 1040 J of 800: 1.30\n" in report
    assert "    0:05.0 leg to 3, 100 m: 9.8 s, 1040 J\n" in report
    assert "legs" not in summary_as_text(forward, "x")


def test_two_clocks_are_told_apart_where_they_differ(forward):
    assert "its clock ran" not in summary_as_text(forward, "x")
    fast = replace(forward, flights=(replace(forward.flights[0], clock_rate=2.0),))
    report = summary_as_text(fast, "x")
    assert "its clock ran 2 times as fast as the recorder's: times from here on are the vehicle's" in report


def test_a_clock_set_forward_and_stamps_of_the_other_byte_order_are_told(forward):
    told = replace(forward, clock_set_forward=1, clock_forward=1.7e9, byte_order="little")
    report = summary_as_text(told, "x")
    assert "the recording clock was set forward once, by 19,676 days, which are no time of flight" in report
    assert "time stamps are little-endian" in report
    twice = summary_as_text(replace(forward, clock_set_forward=2, clock_forward=7200.0), "x")
    assert "set forward 2 times, by up to 2:00:00.0" in twice
