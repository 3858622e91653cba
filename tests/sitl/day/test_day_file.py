"""Days as they are written: what is read, and what is refused with its place."""

import pytest

from sitl.day import DayError, load_day
from sitl.simulation.avionics import Navigation
from tests.support.paths import DATA

LEAST = 'name = "d"\nduration = 10.0\narena = "voliere"\n'


def written(tmp_path, text):
    path = tmp_path / "day.toml"
    path.write_text(text)
    return path


def test_the_example_is_read():
    day = load_day(DATA / "voliere-day.toml")
    assert (day.seed, day.arena, day.plan) == (1, "voliere", DATA / "flight_plans" / "voliere.xml")
    assert day.actions[0][:3] == (5.0, "block", "Takeoff")
    assert day.actions[2].value == (0.5, -1.0, 2.5)
    assert [failure.lasts for failure in day.failures] == [0.5, 5.0, 10.0]


def test_the_least_day_has_the_usual_values(tmp_path):
    day = load_day(written(tmp_path, LEAST))
    assert (day.seed, day.plan, day.navigation, day.actions, day.schedule) == (1, None, None, (), ())
    assert load_day(written(tmp_path, LEAST + 'navigation = "truth"\n')).navigation is Navigation.TRUTH


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "duration is missing"),
        (LEAST + "sed = 3\n", "sed is not known; did you mean 'seed'?"),
        (LEAST.replace("10.0", "-1"), "duration = -1 is not within 1 and 7200"),
        (LEAST + "[[operator]]\nat = 1.0\n", r"operator\[0\] must have one of block"),
        (LEAST + '[[operator]]\nat = 11.0\nblock = "x"\n', r"operator\[0\]\.at = 11 is not within 0 and 10"),
        (LEAST + '[[operator]]\nat = 1.0\nwaypoint = "P"\n', r"operator\[0\]\.to is missing"),
        (
            LEAST + '[[failure]]\nat = 1.0\nunit = "wing"\nfailure = "off"\n',
            r"failure\[0\]\.unit = 'wing' must be one of",
        ),
        (LEAST + "[wind]\nschedule = [[2.0, 1.0], [1.0, 2.0]]\n", "wind.schedule has times that do not increase"),
        (LEAST + "[wind]\ngusts = [[1.0]]\n", "wind.gusts must be lines of 3 numbers"),
        ("name = ", "is not TOML"),
        (LEAST + "parameters = 3\n", "parameters must be a table"),
    ],
)
def test_what_cannot_be_flown_is_refused_with_its_place(tmp_path, text, said):
    with pytest.raises(DayError, match=rf"day\.toml: .*{said}"):
        load_day(written(tmp_path, text))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(DayError, match=r"none\.toml: cannot be read: No such file"):
        load_day(tmp_path / "none.toml")
