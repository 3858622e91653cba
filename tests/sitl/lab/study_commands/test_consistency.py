"""``darko-sitl study consistency``: its arguments, its verdict, and its file."""

import json

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.lab.studies import consistency
from sitl.lab.studies.consistency import ConsistencyDraw, ConsistencyFlight, Phase


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--nav", "truth"], "--nav truth: there is no filter to judge"),
        (["--flights", "0"], "--flights 0: there must be at least 1"),
        (["--jobs", "0"], "--jobs 0: there must be at least 1"),
        (["--gusts", "-1"], "--gusts -1 is not within 0 and 10"),
        (["--sensors", "/nowhere/own.toml"], "/nowhere/own.toml: No such file"),
        (["--json", "/nowhere/c.json"], "/nowhere/c.json: there is no folder /nowhere"),
    ],
)
def test_bad_arguments_are_refused_before_any_flight(arguments, message, capsys):
    assert main(["study", "consistency", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert "Traceback" not in said


def judged(monkeypatch, nees, *more):
    """The exit code for flights whose filters are all so wrong: of all errors, without the wind, of the wind."""

    def run(seeds, craft, jobs, on_progress, gusts):
        draws = [
            ConsistencyDraw(seed, phase, wrong, gusts) for wrong in (False, True) for phase in Phase for seed in seeds
        ]
        lines = np.tile([50.0, 50.0, 50.0, 50.0, 0.0, 0.0, 100.0], (4, 1))
        looks = (np.tile(nees, (5, 1)), np.ones(9), np.ones(9), lines, lines)
        return [ConsistencyFlight(draw, *looks) for draw in draws]

    monkeypatch.setattr(consistency, "run", run)
    return main(["study", "consistency", "--flights", "4", "--jobs", "1", *more])


def test_the_verdict_is_whether_it_is_surer_than_it_may_be(monkeypatch, capsys):
    assert judged(monkeypatch, (18.0, 15.0, 3.0)) == 0
    assert "NEES 18.00" in capsys.readouterr().out
    assert judged(monkeypatch, (6.0, 5.0, 1.0)) == 0  # shy is not wrong
    assert judged(monkeypatch, (28.0, 15.0, 3.0)) == 1
    assert judged(monkeypatch, (18.0, 25.0, 3.0)) == 1
    assert judged(monkeypatch, (18.0, 15.0, 9.0)) == 1


def test_every_flight_is_written(monkeypatch, tmp_path):
    path = tmp_path / "consistency.json"
    assert judged(monkeypatch, (18.0, 15.0, 3.0), "--gusts", "1.5", "--json", str(path)) == 0
    written = json.loads(path.read_text())
    assert "gusts=1.5" in written[0]["draw"]
    assert len(written) == 4 * len(Phase) * 2
    assert written[0]["nees"] == [18.0] * 5
