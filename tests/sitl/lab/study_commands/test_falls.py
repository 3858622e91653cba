"""``darko-sitl study falls`` and ``landings``: when they pass, what they write, what they refuse before any flight."""

import json

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.lab.studies import falls
from sitl.lab.studies import falls as falls_command
from sitl.lab.studies import landings as landings_command
from sitl.lab.studies.falls import AircraftFall, FallEnd, HeightLost
from sitl.lab.studies.landings import Landing, LandingEnd
from sitl.model.vectors import Vector

SAME = HeightLost("", np.array([5.0]), np.array([5.0]), np.zeros(1))
AT_HOME = AircraftFall(1, Vector(0.0, 0.0, -9.0), FallEnd.HOME, 20.0, 9.0, 0.1, ())
WELL = Landing(1, 2.0, 0.5, LandingEnd.UPRIGHT, 0.1, 0.5, 0.1, 0.2, 13.0)


def falls_of(crashed, late=0):
    lost = [AT_HOME._replace(end=FallEnd.CRASHED)] * crashed + [AT_HOME._replace(end=FallEnd.LATE)] * late
    return lost + [AT_HOME] * (100 - len(lost))


def test_the_falls_pass_without_a_loss_in_the_calm_and_with_few_in_wind():
    assert falls_command.passed([SAME], falls_of(0), falls_of(3, late=5))
    assert not falls_command.passed([SAME], falls_of(0), falls_of(4))
    assert not falls_command.passed([SAME], falls_of(1), falls_of(0))
    assert not falls_command.passed([SAME], falls_of(0, late=1), falls_of(0))
    assert not falls_command.passed([SAME._replace(supervisor=np.array([7.0]))], falls_of(0), falls_of(0))
    assert not falls_command.passed([SAME._replace(away=np.array([9.0]))], falls_of(0), falls_of(0))


def test_the_landings_pass_if_most_end_upright_and_none_bounces_for_long():
    tipped = WELL._replace(end=LandingEnd.TIPPED)
    assert landings_command.passed([WELL] * 98 + [tipped] * 2)
    assert not landings_command.passed([WELL] * 97 + [tipped] * 3)
    assert not landings_command.passed([WELL] * 99 + [WELL._replace(bounce=3.1)])


def test_falls_are_printed_drawn_and_written(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(falls, "FALL_KINDS", {"15 m/s down": (0.0, 0.0, -15.0)})
    monkeypatch.setattr(falls, "MAP_SINKS", (0.0, 10.0))
    monkeypatch.setattr(falls, "MAP_TUMBLES", (8.0,))
    plot, table = tmp_path / "f.png", tmp_path / "f.json"
    arguments = [
        "--flights",
        "1",
        "--draws",
        "1",
        "--first",
        "3",
        "--jobs",
        "1",
        "--plot",
        str(plot),
        "--json",
        str(table),
    ]
    assert main(["study", "falls", *arguments]) == 0
    out = capsys.readouterr().out
    assert out.startswith("1 draws, seeds 3 to 3")
    assert out.count("1 falls from 120 m, seeds 3 to 3: 0 crashed, 1 home") == 2
    assert plot.read_bytes().startswith(b"\x89PNG")
    written = json.loads(table.read_text())
    assert len(written["heights"]) == 1
    assert len(written["map"]) == 2
    assert written["calm"][0]["seed"] == 3


def test_landings_are_printed_and_written(tmp_path, capsys):
    table = tmp_path / "l.json"
    assert main(["study", "landings", "--flights", "1", "--jobs", "1", "--json", str(table)]) == 0
    assert capsys.readouterr().out.startswith("1 landings from 8 m, seeds 1 to 1: 1 upright")
    assert json.loads(table.read_text())[0]["end"] == LandingEnd.UPRIGHT


def test_landings_asked_for_on_the_way_are_printed_and_written(tmp_path, capsys):
    table = tmp_path / "l.json"
    arguments = ["--kind", "asked", "--flights", "1", "--jobs", "1", "--nav", "truth", "--json", str(table)]
    assert main(["study", "landings", *arguments]) == 0
    out = capsys.readouterr().out
    assert out.startswith("1 returns and landings asked for on the way, seeds 1 to 1\ncalm: 1 upright")
    written = json.loads(table.read_text())[0]
    assert written["good"]
    assert written["request"] in {"RTL", "LAND"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["study", "falls", "--flights", "0"], "--flights 0: there must be at least 1"),
        (["study", "falls", "--draws", "0"], "--draws 0: there must be at least 1"),
        (["study", "falls", "--first", "-1"], "seeds are not negative"),
        (["study", "falls", "--plot", "f.txt"], "the name must end in .png"),
        (["study", "falls", "--json", "/nosuch/f.json"], "there is no folder /nosuch"),
        (["study", "falls", "--airframe", "nosuch"], "no parameter set 'nosuch'"),
        (["study", "landings", "--jobs", "0"], "--jobs 0: there must be at least 1"),
        (["study", "landings", "--gusts", "99"], "--gusts 99 is not within"),
        (["study", "landings", "--kind", "air", "--wind", "99"], "--wind 99 is not within"),
        (["study", "landings", "--json", "/nosuch/f.json"], "there is no folder /nosuch"),
    ],
)
def test_bad_arguments_are_refused_before_any_flight(arguments, words, capsys):
    assert main(arguments) == 2
    err = capsys.readouterr().err
    assert words in err
    assert len(err.splitlines()) == 1
