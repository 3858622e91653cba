"""``darko-sitl study failures``: its arguments, its table and its file."""

import json

import pytest

from sitl.__main__ import main
from sitl.lab.studies import failure_flights
from sitl.sensors.instruments import OFF


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


def test_the_flights_are_printed_and_written(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(failure_flights, "BATTERY_FAILURES", {OFF})  # any other is flown with for a minute
    path = tmp_path / "failures.json"
    arguments = ["--units", "battery", "--flights", "1", "--jobs", "1", "--json", str(path)]
    assert main(["study", "failures", *arguments]) == 0
    assert "| battery off | hover | 1 landed |" in capsys.readouterr().out
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
    assert "1 of 1 flew away" in capsys.readouterr().out
