"""``darko-sitl study margins``: its arguments, its verdict, and its file."""

import json
import math

import pytest

from sitl.__main__ import main
from sitl.lab.studies import margins
from sitl.lab.studies.margins import MarginFlight

FEW = ["study", "margins", "--flights", "1", "--jobs", "1", "--nav", "mocap"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--delay", "0.2"], "--delay 0.2 is not within 0 and 0.1"),
        (["--delay", "0.01", "-0.01"], "--delay -0.01 is not within 0 and 0.1"),
        (["--noise", "101"], "--noise 101 is not within 0 and 100"),
        (["--noise", "-1"], "--noise -1 is not within 0 and 100"),
        (["--flights", "0"], "--flights 0: there must be at least 1"),
        (["--first", "-1"], "--first -1: seeds are not negative"),
        (["--sensors", "/nowhere/own.toml"], "/nowhere/own.toml: No such file"),
        (["--json", "/nowhere/margins.json"], "/nowhere/margins.json: there is no folder /nowhere"),
    ],
)
def test_bad_arguments_are_refused_before_any_flight(arguments, message, capsys):
    assert main(["study", "margins", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert "Traceback" not in said


@pytest.fixture
def flown(monkeypatch):
    """The draws that were asked for; those above a delay do not converge."""
    asked = []

    def run(draws, craft, jobs, on_progress):
        asked.extend(draws)
        return [MarginFlight(draw, draw.delay < 0.05, 0.1, math.radians(20.0), "") for draw in draws]

    monkeypatch.setattr(margins, "run", run)
    return asked


def test_the_verdict_asks_for_forty_milliseconds_at_the_specified_noise(flown, monkeypatch, capsys):
    assert main([*FEW, "--delay", "0", "0.04", "0.06", "--noise", "1", "4"]) == 0
    assert {draw.delay for draw in flown} == {0.0, 0.04, 0.06}
    assert {draw.noise for draw in flown} == {1.0, 4.0}
    assert "0/1" in capsys.readouterr().out
    monkeypatch.setattr("sitl.lab.studies.margins.SURVIVED_DELAY", 0.06)
    assert main([*FEW, "--delay", "0.06", "--noise", "1"]) == 1


def test_every_flight_is_written(flown, tmp_path):
    path = tmp_path / "margins.json"
    assert main([*FEW, "--delay", "0.01", "--noise", "2", "--json", str(path)]) == 0
    written = json.loads(path.read_text())
    assert len(written) == len(flown) == 3
    assert written[0]["draw"] == {"seed": 1, "manoeuvre": "hover, linear law", "delay": 0.01, "noise": 2.0}
