"""``darko-sitl study holds``: its arguments, its verdict, and its file."""

import json

import pytest

from sitl.__main__ import main
from sitl.lab.studies.holds import FlownHold, passed

NEAR = FlownHold(seed=1, wind=5.0, across=0.9, above=0.7, farthest=2.0, highest=1.0, near=0.95, laws=1, fault="")


@pytest.mark.parametrize(
    ("hold", "near"),
    [
        (NEAR, True),
        (NEAR._replace(near=0.94), False),
        (NEAR._replace(near=1.0), True),
        (NEAR._replace(wind=8.0, near=0.94), False),
        (NEAR._replace(near=1.0, fault="diverged"), False),
    ],
)
def test_the_holds_of_each_wind_are_near_for_most_of_the_time(hold, near):
    assert passed([NEAR, hold]) is near


def test_one_hold_may_be_off_for_longer_where_the_others_make_up_for_it():
    assert passed([NEAR._replace(near=0.92), NEAR._replace(near=0.99)])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--wind", "40"], "--wind 40 is not within 0 and 30"),
        (["--gusts", "-1"], "--gusts -1 is not within 0 and 10"),
        (["--flights", "0"], "--flights 0: there must be at least 1"),
        (["--first", "-3"], "--first -3: seeds are not negative"),
        (["--parameters", "0.6"], "--parameters 0.6 is not within 0 and 0.5"),
        (["--json", "/nowhere/holds.json"], "/nowhere/holds.json: there is no folder /nowhere"),
    ],
)
def test_bad_arguments_are_refused_before_any_flight(arguments, message, capsys):
    assert main(["study", "holds", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_the_holds_are_printed_and_written(tmp_path, capsys):
    path = tmp_path / "holds.json"
    arguments = ["--nav", "truth", "--wind", "0", "--gusts", "0", "--flights", "1", "--jobs", "1", "--json", str(path)]
    assert main(["study", "holds", *arguments]) == 0
    assert "0      1" in capsys.readouterr().out
    (written,) = json.loads(path.read_text())
    assert written["seed"] == 1
    assert written["across"] < 0.01
