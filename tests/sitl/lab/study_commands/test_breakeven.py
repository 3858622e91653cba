"""``darko-sitl study breakeven``: JSON output and refused arguments."""

import json

import pytest

from sitl.__main__ import main


def test_the_command_prints_the_table_as_json(capsys):
    assert main(["study", "breakeven", "--json", "--airspeed", "12"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert len(printed["predicted"]) == 90
    assert {cell["barred"] for cell in printed["predicted"]} <= {"NONE", "TOO_SHORT", "TOO_STEEP", "ENERGY"}


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--airframe", "published"], "published"),
        (["--airframe", "nowhere"], "nowhere"),
        (["--airspeed", "30"], "30"),
    ],
)
def test_a_bad_argument_is_a_one_line_error(capsys, arguments, word):
    assert main(["study", "breakeven", *arguments]) == 2
    error = capsys.readouterr().err
    assert word in error
    assert error.count("\n") == 1
