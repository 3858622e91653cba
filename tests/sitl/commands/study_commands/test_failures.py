"""``darko-sitl failures``: its arguments, its table and its file."""

import json

import pytest

from sitl.__main__ import main
from sitl.sensors.instruments import OFF
from sitl.studies import failure_flights


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--units", "wing"], "--units wing: there are gyroscope, accelerometer"),
        (["--flights", "0"], "--flights 0: there must be at least 1"),
        (["--nav", "mocap"], "--nav mocap: failures are flown on satellites"),
        (["--json", "/nowhere/f.json"], "/nowhere/f.json: there is no folder /nowhere"),
    ],
)
def test_bad_arguments_are_refused_before_any_flight(arguments, message, capsys):
    assert main(["failures", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_the_flights_are_printed_and_written(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(failure_flights, "BATTERY_FAILURES", {OFF})  # any other is flown with for a minute
    path = tmp_path / "failures.json"
    arguments = ["--units", "battery", "--flights", "1", "--jobs", "1", "--json", str(path)]
    assert main(["failures", *arguments]) == 0
    assert "| battery off | hover | 1 landed |" in capsys.readouterr().out
    assert {(flight["unit"], flight["phase"]) for flight in json.loads(path.read_text())} == {
        ("battery", phase) for phase in ("hover", "transition", "cruise")
    }
