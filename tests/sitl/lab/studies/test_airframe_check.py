"""The check of an airframe: what passes, and in words what is too small."""

import pytest

from sitl.__main__ import main
from sitl.lab.studies.airframe_check import CheckRow, check_airframe, summary
from sitl.model.airframe_files import load


def missed(name):
    return {row.name: row for row in check_airframe(name, fly=False) if not row.passed}


def with_value(path, base, **values):
    """A file of a set with some of its values changed, in its own units."""
    known = load(base).values
    lines = [f'[set]\nname = "mine"\ndescription = "x"\nbase = "{base}"']
    lines += [f'[{key}]\nvalue = {value}\nunit = "{known[key].unit}"\nsource = "x"' for key, value in values.items()]
    path.write_text("\n".join(lines))
    return str(path)


@pytest.mark.parametrize("name", ["darko", "collage", "nominal"])
def test_what_flies_passes_by_its_numbers(name):
    assert missed(name) == {}


@pytest.mark.parametrize(
    ("values", "row", "words"),
    [
        ({"m": 0.9}, "thrust to weight", "thrust at omega_max is too small for 0.9 kg"),
        ({"omega_min": 1300.0}, "propellers in the hover", "the weight asks for another speed"),
        ({"xi_m": 0.05}, "pitch in the hover", "elevons together"),
        ({"a_y": 0.02}, "roll in the hover", "elevons apart"),
        ({"p_y": 0.02}, "yaw in the hover", "motors apart"),
        ({"delta_max": 4.0}, "hover held in wind to", "elevons need"),
        ({"delta_max": 12.0}, "both transitions", "m/s: elevons need"),
    ],
)
def test_what_is_too_small_is_told_in_words(tmp_path, values, row, words):
    found = missed(with_value(tmp_path / "mine.toml", "darko", **values))
    assert words in found[row].remedy


def test_the_numbers_are_those_of_the_airframe():
    rows = {row.name: row for row in check_airframe("darko", fly=False)}
    assert float(rows["thrust to weight"].value) == pytest.approx(1.74, abs=0.005)
    assert rows["propellers in the hover"].value == "1281 rad/s"


def test_the_summary_counts_and_explains():
    rows = [CheckRow("a", "1", ">= 0", True), CheckRow("b", "none", ">= 2", False, "more of it")]
    told = "the airframe itself is too weak for these tests, not its laws: b none, must be >= 2"
    assert summary("x", rows)[-3:] == ["b is none, must be >= 2: more of it", told, "1 of 2 passed"]
    poor = rows[1]._replace(flown=True)
    assert summary("x", [rows[0], poor])[-2:] == ["b is none, must be >= 2: more of it", "1 of 2 passed"]


@pytest.mark.long
def test_the_aircraft_that_was_built_passes_and_one_that_is_too_heavy_does_not(tmp_path, capsys):
    assert main(["airframe", "check", "darko"]) == 0
    assert "12 of 12 passed" in capsys.readouterr().out
    heavy = with_value(tmp_path / "heavy.toml", "darko", m=0.72)
    assert main(["airframe", "check", heavy]) == 1
    assert "thrust to weight is" in capsys.readouterr().out


def test_check_takes_a_file_and_nothing_else_does(capsys):
    assert main(["airframe", "check"]) == 2
    assert "airframe check FILE" in capsys.readouterr().err
    assert main(["airframe", "darko", "collage"]) == 2
    assert "only check takes two words" in capsys.readouterr().err
