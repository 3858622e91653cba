"""``scripts/where.py`` finds files, classes and functions by words, and says where nothing is."""

import pytest

from scripts.where import main, places


@pytest.mark.long
@pytest.mark.parametrize(
    ("words", "found"),
    [
        (["damage", "tlog"], "protocol/tlog/scan.py"),
        (["Propeller", "torque"], "sitl/model/propeller.py"),
        (["gusts", "draws"], "sitl/simulation/noise.py"),
        (["magnetometer", "noise"], "sitl/sensors/data/magnetometer.toml"),
        (["wingShape"], "protocol/flight_log/page/flight_scene.js"),
    ],
)
def test_files_are_found_by_parts_of_words_in_any_case(words, found, capsys):
    assert main(words) == 0
    assert found in capsys.readouterr().out


def test_a_word_that_is_nowhere_ends_with_1_and_prints_nothing(capsys):
    assert main(["nosuchwordanywhere"]) == 1
    assert capsys.readouterr().out == ""


@pytest.mark.long
def test_where_nothing_has_every_word_those_with_all_but_one_are_shown(capsys):
    assert main(["caught", "fall", "nosuchwordanywhere"]) == 0
    first, *places_found = capsys.readouterr().out.splitlines()
    assert first == "nothing has every word, these have all but one:"
    assert any("supervisor/guards.py" in line for line in places_found)


@pytest.mark.long
def test_many_places_are_cut_and_counted(capsys):
    assert main(["e"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 41
    assert lines[-1].startswith("and ")


def test_every_file_says_what_it_holds():
    """But for those that are empty, or the way into a package."""
    assert [place.path for place in places() if not place.name and not place.about if "__" not in place.path] == []
