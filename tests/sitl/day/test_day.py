"""Days as they are written: what is read, and what is refused with its place."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from protocol.flight_log.flight_series import flight_series
from protocol.tlog import read_tlog
from sitl.commands import day as day_command
from sitl.day import DayAircraft, DayError, day_page, fly_day, load_day, scenery_of
from sitl.enclosure.arena_files import load_arena
from sitl.simulation.avionics import Navigation
from tests.support.paths import DATA

LEAST = 'name = "d"\nduration = 10.0\narena = "voliere"\n'


def written(tmp_path, text):
    path = tmp_path / "day.toml"
    path.write_text(text)
    return path


def test_the_example_is_read():
    day = load_day(DATA / "voliere-day.toml")
    assert (day.seed, day.arena, day.plan) == (1, "voliere", DATA / "voliere")
    assert day.actions[0][:3] == (5.0, "block", "Takeoff")
    assert day.actions[2].value == (0.5, -1.0, 2.5)
    assert [failure.lasts for failure in day.failures] == [0.5, 5.0, 10.0]


def test_an_airframe_is_one_that_is_shipped_or_a_file_beside_the_day(tmp_path):
    assert load_day(DATA / "wind-staircase.toml").airframe == str(DATA / "darko-quick-servos.toml")
    assert load_day(written(tmp_path, LEAST + 'airframe = "darko"\n')).airframe == "darko"


@pytest.mark.long
def test_the_staircase_switches_its_law_on_before_the_wind_rises():
    """The first 50 of its 215 s."""
    aircraft = DayAircraft(load_day(DATA / "wind-staircase.toml"))
    while aircraft.vehicle.time < 50.0:
        aircraft.advance(10)
    assert aircraft.vehicle.law is Law.ROBUST_PI
    assert not any(event.is_refused for event in aircraft.happened)
    assert np.hypot(aircraft.vehicle.truth.body.position.x - 2.4, aircraft.vehicle.truth.body.position.y) < 0.15


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


# A day flown headless: what happens in it, its record and its page.


EXAMPLE = DATA / "voliere-day.toml"
CHROMIUM = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--virtual-time-budget=8000",
    "--dump-dom",
)  # fmt: skip


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    return fly_day(load_day(EXAMPLE), tmp_path_factory.mktemp("day"))


def texts(flown):
    return [event.text for event in flown.aircraft.happened]


@pytest.mark.long
def test_the_example_is_flown_as_it_is_written(flown):
    assert flown.verdict == "flown as written"
    assert flown.seconds == pytest.approx(205.0, abs=0.1)
    assert flown.aircraft.vehicle.law is Law.LANDED
    for block in ("Takeoff", "Standby", "Route", "Ring", "Figures", "Land", "Landed"):
        assert f"block {block}" in texts(flown)


@pytest.mark.long
def test_the_vehicle_goes_where_the_waypoint_was_moved(flown):
    series = flight_series(read_tlog(flown.log), "day")
    at = np.searchsorted(series.position.times, 70.0)
    place = [series.position.fields[axis][at] for axis in "xyz"]
    assert place == pytest.approx([-1.0, 0.5, -2.5], abs=0.5)


@pytest.mark.long
def test_the_record_has_the_truth_beside_the_estimate(flown):
    series = flight_series(read_tlog(flown.log), "day")
    assert len(series.truth) > 2000
    true = np.interp(series.position.times, series.truth.times, series.truth.fields["position"][:, 0])
    assert np.abs(series.position.fields["x"] - true).max() < 0.3


@pytest.mark.long
def test_the_same_seed_is_the_same_day(tmp_path):
    short = load_day(EXAMPLE)._replace(duration=7.0)  # it has taken off by then
    first, second = (fly_day(short, tmp_path / name).log.read_bytes() for name in "ab")
    assert first == second
    assert fly_day(short._replace(seed=2), tmp_path / "c").log.read_bytes() != first


def test_a_refusal_is_reported_and_the_day_goes_on(tmp_path):
    day = load_day(EXAMPLE)._replace(duration=7.0)
    wrong = day.actions[0]._replace(at=1.0, name="Nowhere")
    flown = fly_day(day._replace(actions=(wrong, *day.actions)), tmp_path)
    assert flown.verdict == "flown to its end; the vehicle refused 1 request"
    assert "the plan has no block 'Nowhere'" in flown.refused[0].text
    assert "block Takeoff" in texts(flown)


def test_a_live_day_says_when_it_is_over_and_a_fast_one_stops_there(tmp_path):
    day = load_day(EXAMPLE)._replace(duration=1.0)
    live = DayAircraft(day)
    live.advance(600)
    assert "The day is over; the vehicle goes on" in [notice.text for notice in live.autopilot.notices()]
    assert texts(fly_day(day, tmp_path)) == ["block Engine off"]


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("arena", "nowhere", "arena nowhere: No such file"),
        ("plan", Path("none.xml"), "none.xml cannot be read"),
        ("parameters", {"NOPE": 1.0}, "NOPE"),
    ],
)
def test_what_the_day_names_and_is_not_there_is_refused_with_the_day(key, value, said):
    day = load_day(EXAMPLE)._replace(file=Path("today.toml"), **{key: value})
    with pytest.raises(DayError, match=rf"^today\.toml: .*{said}"):
        DayAircraft(day)


def test_wind_without_a_wall_is_refused():
    day = load_day(EXAMPLE)._replace(arena="open")
    with pytest.raises(DayError, match="the arena 'open' has no wind wall"):
        DayAircraft(day)


def test_the_scenery_has_net_and_wall():
    names = {prism.name: prism for prism in scenery_of(load_arena("voliere"))}
    assert names["net"].hollow
    assert max(north for north, _ in names["wind wall"].corners) > 4.5


@pytest.mark.long
def test_the_page_has_all_that_was_asked_for(flown):
    pytest.importorskip("plotly")
    page = day_page(flown)
    for heading in ("Path", "Lyapunov values and jumps", "Actuators", "Energy by law", "Tracking", "Wind", "Events"):
        assert f"<h2>{heading}" in page
    assert "operator moves STDBY" in page


@pytest.mark.long
@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium")
def test_a_browser_draws_every_chart(flown, tmp_path):
    pytest.importorskip("plotly")
    page = tmp_path / "day.html"
    page.write_text(day_page(flown))
    command = ["chromium", *CHROMIUM, f"--user-data-dir={tmp_path / 'profile'}", page.as_uri()]
    dom = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    assert dom.count('class="main-svg"') >= 10
    assert dom.count("js-plotly-plot") >= 5
    assert "operator moves STDBY" in dom


@pytest.mark.long
def test_the_command_writes_page_and_log_and_says_how_it_went(tmp_path, capsys):
    pytest.importorskip("plotly")
    short = tmp_path / "short.toml"
    short.write_text('name = "short"\nduration = 3.0\narena = "voliere"\n')
    page, log = tmp_path / "page.html", tmp_path / "short.tlog"
    args = day_command.parser({"day": "d"}).parse_args([str(short), "--out", str(page), "--log", str(log)])
    assert day_command.run(args) == 0
    assert "flown as written: 3.0 s" in capsys.readouterr().out
    assert page.exists()
    assert len(read_tlog(log)) > 100
