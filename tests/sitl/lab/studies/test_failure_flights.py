"""Failures on purpose from seeds: what is flown, and how it is counted."""

import json
import math

import pytest

from sitl.__main__ import main
from sitl.errors import SitlError
from sitl.lab.studies import failure_flights
from sitl.lab.studies.failure_flights import (
    FAILING_UNITS,
    LEFT_WITHIN,
    NO_UNIT,
    ON_PLAN,
    FailedFlight,
    FailureConditions,
    FailureDraw,
    FailureEnd,
    FailurePhase,
    distance_from,
    draws,
    failures_of,
    fly_failure,
    run_failures,
    summary,
)
from sitl.sensors.instruments import DELAYED, DRIFTING, OFF, SCALED, STUCK, WRONG

FLOWN = FailedFlight(
    unit="motor", failure="off", phase=FailurePhase.HOVER, seed=1, end=FailureEnd.CUT, noticed=2.1, said="Motors cut",
    off=1.5, astray=0.2, forward=False, impact=17.6, time=4.4,
)  # fmt: skip


def test_every_failure_of_a_unit_is_drawn_in_every_phase_by_every_seed():
    drawn = draws([1, 2], ["motor", "battery"])
    assert len(drawn) == len(set(drawn)) == (4 + 2) * 5 * 2
    assert {draw.seed for draw in drawn} == {1, 2}
    assert all(OFF in failures_of(unit) for unit in FAILING_UNITS)


def test_nothing_to_fly_is_refused():
    with pytest.raises(SitlError, match="0 flights"):
        run_failures([])


def test_a_motor_that_is_off_is_noticed_and_the_vehicle_comes_down_with_motors_off():
    flight = fly_failure(FailureDraw("motor", OFF, FailurePhase.HOVER, 1))
    assert (flight.end, flight.failure) == (FailureEnd.CUT, "off")
    assert flight.said.startswith("Motors cut: a motor or an elevon failed")
    assert flight.noticed < flight.time < 10.0
    assert flight.impact > 5.0


@pytest.mark.long
def test_in_cruise_a_magnetometer_that_is_stuck_is_noticed_and_changes_nothing():
    flight = fly_failure(FailureDraw("magnetometer", STUCK, FailurePhase.CRUISE, 1))
    assert flight.end is FailureEnd.FLIES
    assert flight.noticed < 5.0
    assert flight.astray < 2.0


def test_a_pitot_that_reads_six_too_much_is_flown_without_and_named():
    flight = fly_failure(FailureDraw("pitot", WRONG, FailurePhase.TRANSITION, 1))
    assert (flight.end, flight.forward, flight.away) == (FailureEnd.FLIES, False, False)
    assert flight.said == "Flying without pitot tube"
    assert flight.off < 10.0


@pytest.mark.long
@pytest.mark.parametrize(
    ("unit", "failure", "phase", "seed"),
    [
        ("gyroscope", WRONG, FailurePhase.BACK, 6),  # 97 m off while field and satellites were refused for long
        ("gyroscope", DRIFTING, FailurePhase.RETURN, 6),  # 110 m off where the doubt of it ended too soon
        ("gyroscope", SCALED, FailurePhase.TRANSITION, 5),  # 121 m off while the accelerometer was doubted for it
        ("accelerometer", DELAYED, FailurePhase.BACK, 14),  # 70 m off while the attitude was doubted for it
        ("accelerometer", STUCK, FailurePhase.TRANSITION, 17),  # 197 m off in a wind that nothing told any more
    ],
)
def test_an_inertial_instrument_that_misleads_is_flown_without(unit, failure, phase, seed):
    flight = fly_failure(FailureDraw(unit, failure, phase, seed))
    assert flight.end in {FailureEnd.FLIES, FailureEnd.LANDED}
    assert not flight.away
    assert flight.off < 15.0
    assert flight.said


def test_without_a_position_it_is_down_before_it_is_far_away():
    flight = fly_failure(FailureDraw("gnss", STUCK, FailurePhase.HOVER, 14))
    assert (flight.end, flight.away) == (FailureEnd.LANDED, False)
    assert flight.off < 60.0  # m; with a healthy vehicle's patience it hovered on, 67 m away


@pytest.mark.long
def test_an_updraught_far_above_the_ground_is_no_touch_down():
    (draw,) = draws([17], [NO_UNIT], [FailurePhase.RETURN])
    flight = fly_failure(draw, conditions=FailureConditions(wind=12.0, gusts=2.0))
    assert (flight.end, flight.said) == (FailureEnd.FLIES, "")


def test_nothing_that_fails_raises_no_alarm():
    (draw,) = draws([1], [NO_UNIT], [FailurePhase.BACK])
    flight = fly_failure(draw)
    assert (flight.end, flight.said, flight.away) == (FailureEnd.FLIES, "", False)


@pytest.mark.parametrize(
    ("change", "away"),
    [
        ({}, False),
        ({"said": "", "noticed": math.inf}, False),  # cut without a word is still no crash
        ({"end": FailureEnd.CRASHED}, False),
        ({"end": FailureEnd.CRASHED, "said": ""}, True),
        ({"end": FailureEnd.FLIES, "off": ON_PLAN, "said": "", "forward": True}, False),
        ({"end": FailureEnd.FLIES, "off": ON_PLAN + 0.1, "said": ""}, True),
        ({"end": FailureEnd.FLIES, "off": ON_PLAN + 0.1}, False),
        ({"end": FailureEnd.FLIES, "off": ON_PLAN + 0.1, "forward": True}, True),
        ({"end": FailureEnd.LANDED, "off": LEFT_WITHIN + 0.1}, True),
    ],
)
def test_a_flight_is_judged_by_the_truth_against_its_plan(change, away):
    assert FLOWN._replace(**change).away == away


def test_the_distance_from_a_way_is_to_its_nearest_stretch():
    way = [(0.0, 0.0, 40.0), (300.0, 0.0, 40.0), (300.0, 150.0, 40.0)]
    assert distance_from(way, (100.0, -7.0, 40.0)) == pytest.approx(7.0)
    assert distance_from(way, (100.0, 0.0, 61.0)) == pytest.approx(21.0)
    assert distance_from(way, (100.0, 0.0, 61.0), level=True) == pytest.approx(0.0)
    assert distance_from(way, (303.0, 154.0, 40.0)) == pytest.approx(5.0)
    assert distance_from(way[:1], (3.0, 4.0, 40.0)) == pytest.approx(5.0)


def test_the_summary_counts_the_ends_and_names_the_worst():
    flies = FLOWN._replace(seed=2, end=FailureEnd.FLIES, noticed=math.inf, said="", impact=0.0, off=70.0)
    rows = summary([FLOWN, flies])[2:]
    assert rows == [
        "| motor off | hover | 1 flies (1.3 to 98.7 %), 1 motors off (1.3 to 98.7 %), 1 **away** (1.3 to 98.7 %) "
        "| 2.1 s (1) | 70.0 m | 0.2 m | 18 m/s |",
        "",
        "1 of 2 (1.3 to 98.7 %) flew away",
        "away: motor off, hover, seed 2: 70 m, no word",
    ]


# ``darko-sitl study failures``: its arguments, its table and its file.


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--units", "wing"], "--units wing: there are gyroscope, accelerometer"),
        (["--flights", "0"], "--flights 0: there must be at least 1"),
        (["--nav", "truth"], "--nav truth: a vehicle that sees the truth has no instruments"),
        (["--nav", "mocap", "--units", "gnss"], "--units gnss: there are gyroscope"),
        (["--phases", "taxi"], "--phases taxi: there are hover, transition"),
        (["--failures", "tired"], "--failures tired: there are off, stuck"),
        (["--json", "/nowhere/f.json"], "/nowhere/f.json: there is no folder /nowhere"),
    ],
)
def test_bad_arguments_are_refused_before_any_flight(arguments, message, capsys):
    assert main(["study", "failures", *arguments]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.long
def test_the_flights_are_printed_and_written(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(failure_flights, "BATTERY_FAILURES", {OFF})  # any other is flown with for a minute
    path = tmp_path / "failures.json"
    arguments = ["--units", "battery", "--flights", "1", "--jobs", "1", "--json", str(path)]
    assert main(["study", "failures", *arguments]) == 0
    assert "| battery off | hover | 1 landed (2.5 to 100 %) |" in capsys.readouterr().out
    assert {(flight["unit"], flight["phase"]) for flight in json.loads(path.read_text())} == {
        ("battery", phase) for phase in ("hover", "transition", "cruise", "back transition", "return")
    }


def test_a_flight_that_went_away_is_an_exit_code(monkeypatch, capsys):
    gone = failure_flights.FailedFlight(
        unit="pitot", failure="wrong", phase=failure_flights.FailurePhase.CRUISE, seed=1,
        end=failure_flights.FailureEnd.FLIES, noticed=float("inf"), said="", off=500.0, astray=0.4, forward=True,
        impact=0.0, time=60.0,
    )  # fmt: skip
    monkeypatch.setattr(failure_flights, "run_failures", lambda *_args, **_options: [gone])
    assert main(["study", "failures", "--units", "pitot"]) == 1
    assert "1 of 1 (2.5 to 100 %) flew away" in capsys.readouterr().out


@pytest.mark.parametrize(("crashes", "code"), [(1, 0), (2, 1)])
def test_crashes_in_more_than_one_of_twenty_are_an_exit_code(crashes, code, monkeypatch, capsys):
    hit = FLOWN._replace(end=FailureEnd.CRASHED, off=5.0)
    elsewhere = [FLOWN._replace(phase=FailurePhase.CRUISE)] * 40  # dilutes nothing
    flown = [hit] * crashes + [FLOWN] * (20 - crashes) + elsewhere
    monkeypatch.setattr(failure_flights, "run_failures", lambda *_args, **_options: flown)
    assert main(["study", "failures", "--units", "motor"]) == code
    told = capsys.readouterr().out
    assert ("crashes in more than 1 of 20: motor off, hover: 2 of 20 (1.2 to 31.7 %)" in told) == bool(code)
