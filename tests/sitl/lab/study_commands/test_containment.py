"""``darko-sitl study containment`` and ``darko-sitl study jet``: arguments, verdict and files."""

import json

import pytest

from sitl.__main__ import main
from sitl.lab.studies.containment import ContainmentEnd, FlownContainment, stayed_inside

INSIDE = FlownContainment(1, 0.0, 0.0, ContainmentEnd.FLEW_ON, 1.0, 0, 8, 0)


@pytest.mark.parametrize(
    ("flight", "inside"),
    [
        (INSIDE, True),
        (INSIDE._replace(end=ContainmentEnd.TOUCHED), False),
        (INSIDE._replace(end=ContainmentEnd.CUT), False),
        (INSIDE._replace(wall=4.0, end=ContainmentEnd.TOUCHED), True),
        (INSIDE._replace(wall=4.0, accepted_outside=1), False),
    ],
)
def test_in_calm_nothing_may_be_touched_and_no_point_outside_be_accepted(flight, inside):
    assert stayed_inside([INSIDE, flight]) is inside


def test_one_flight_from_the_command_line(tmp_path, capsys):
    file = tmp_path / "flights.json"
    options = ["--flights", "1", "--wall", "0", "--jobs", "1", "--nav", "truth", "--json", str(file)]
    assert main(["study", "containment", *options]) == 0
    assert "points outside: " in capsys.readouterr().out
    assert json.loads(file.read_text())[0]["end"] == "flew on"


def test_one_hold_from_the_command_line(tmp_path, capsys):
    file = tmp_path / "holds.json"
    options = ["--flights", "1", "--wall", "2", "--bursts", "0", "--jobs", "1", "--nav", "truth", "--json", str(file)]
    assert main(["study", "jet", *options]) == 0
    assert capsys.readouterr().out.count("\n") == 2
    assert json.loads(file.read_text())[0]["farthest"] < 1.0


@pytest.mark.parametrize("command", ["containment", "jet"])
@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--flights", "0"], "--flights 0: there must be at least 1"),
        (["--wall", "-1"], "--wall -1 is not within 0 and 30"),
        (["--turbulence", "2"], "--turbulence 2 is not within 0 and 1"),
        (
            ["--arena", "nowhere"],
            "arena nowhere: No such file or directory; shipped are obstacle-course, open",
        ),
    ],
)
def test_bad_arguments_are_one_line(capsys, command, options, reason):
    assert main(["study", command, *options]) == 2
    error = capsys.readouterr().err
    assert reason in error
    assert error.count("\n") == 1
