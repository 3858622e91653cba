"""``darko-sitl study landings``: its arguments and its file."""

import json

import pytest

from sitl.__main__ import main


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--slope", "31"], "--slope 31 is not within 0 and 30"),
        (["--slope", "-1"], "--slope -1 is not within 0 and 30"),
        (["--ground", "-501"], "--ground -501 is not within -500 and 500 m"),
        (["--kind", "air", "--slope", "5"], "--slope and --ground: flights of --kind air do not come to the ground"),
        (["--kind", "air", "--ground", "2"], "--slope and --ground: flights of --kind air do not come to the ground"),
    ],
)
def test_bad_ground_is_refused_before_any_flight(arguments, message, capsys):
    assert main(["study", "landings", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_landings_on_a_slope_are_printed_and_written(tmp_path, capsys):
    path = tmp_path / "landings.json"
    arguments = ["--nav", "truth", "--slope", "5", "--ground", "2", "--flights", "1", "--jobs", "1"]
    assert main(["study", "landings", *arguments, "--json", str(path)]) == 0
    assert "1 upright" in capsys.readouterr().out
    (written,) = json.loads(path.read_text())
    assert written["end"] == "upright"
