"""Falls: what is drawn, what they cost beside the law alone, and that they end at home."""

import json

import numpy as np
import pytest

from sitl import Law, SitlError, Vector, load_airframe
from sitl.__main__ import main
from sitl.lab.studies import falls
from sitl.lab.studies import falls as falls_command
from sitl.lab.studies import landings as landings_command
from sitl.lab.studies.falls import (
    FALL_HEIGHT,
    MAX_TUMBLE,
    SAME_HEIGHT,
    SINKS,
    AircraftFall,
    FallEnd,
    HeightLost,
    MapCell,
    drawn_velocity,
    fall,
    falling,
    thrown,
)
from sitl.lab.studies.landings import Landing, LandingEnd
from sitl.lab.studies.seeded_flights import Craft
from sitl.model.quaternions import x_axis
from sitl.simulation.avionics import Navigation

NOMINAL = load_airframe("nominal").parameters
DOWN = (0.0, 0.0, -15.0)


def test_attitudes_are_drawn_from_all_of_them_and_tumbles_up_to_the_limit():
    draws = [thrown(np.random.default_rng(seed)) for seed in range(400)]
    noses = np.array([x_axis(draw.attitude) for draw in draws])
    rates = np.array([np.linalg.norm(draw.rates) for draw in draws])
    assert np.abs(noses.mean(axis=0)).max() < 0.1
    assert noses[:, 2].std() == pytest.approx(1.0 / np.sqrt(3.0), rel=0.1)
    assert 0.95 * MAX_TUMBLE < rates.max() <= MAX_TUMBLE
    assert np.linalg.norm(thrown(np.random.default_rng(3), 2.5).rates) == pytest.approx(2.5)


@pytest.fixture(scope="module")
def sixteen():
    """Sixteen falls at 15 m/s, under the supervisor and under the law alone."""
    flights = [falling(NOMINAL, seed, DOWN) for seed in range(16)]
    supervisor, away = fall(flights)
    alone, _ = fall([falling(NOMINAL, seed, DOWN, tuning=falls.ALONE) for seed in range(16)])
    return flights, HeightLost("15 m/s down", supervisor, alone, away)


def test_the_supervisor_catches_a_fall_without_losing_more_height_than_the_law_alone(sixteen):
    flights, lost = sixteen
    assert all("catch_fall" in [jump.name for jump in flight.jumps] for flight in flights)
    assert lost.worse == 0
    assert np.median(lost.supervisor) < 40.0


def test_every_fall_ends_at_home_under_the_linear_law(sixteen):
    flights, lost = sixteen
    assert lost.not_home == 0
    assert {flight.law for flight in flights} == {Law.HOVER_LINEAR}


@pytest.mark.parametrize("law", [law for law in Law if law not in {Law.LANDED, Law.CRASHED, Law.HOVER_ZERO_MOMENT}])
def test_a_dive_is_no_equilibrium_whatever_law_it_begins_under(law):
    """Nose down at 40 m/s, where a law that follows the air stream would stay."""
    flight = falling(NOMINAL, 1, (0.0, 0.0, -40.0), tumble=0.0, law=law)
    body = flight.truth.body
    flight.place(body._replace(attitude=type(body.attitude)(0.5**0.5, 0.0, 0.5**0.5, 0.0)))
    flight.step(12.0)
    assert flight.truth.body.position.z > FALL_HEIGHT - 250.0
    assert abs(flight.truth.body.velocity.z) < 5.0


def test_the_counts_are_of_what_is_beyond_the_limits():
    none = np.zeros(3)
    assert HeightLost("", np.array([1.0, 2.0, 3.0]), none, none).worse == 2 + (SAME_HEIGHT < 1.0)
    assert HeightLost("", none, none, np.array([0.5, 1.5, np.nan])).not_home == 2


def test_tables_have_a_line_for_each_kind_and_sink_rate():
    lost = HeightLost("18 m/s level", np.array([1.0, 3.0]), np.array([2.0, 2.0]), np.zeros(2))
    assert falls.summary([lost])[1].split() == [
        "18",
        "m/s",
        "level",
        "2.0",
        "2.9",
        "3.0",
        "2.0",
        "2.0",
        "2.0",
        "0",
        "0",
    ]
    cells = [MapCell(s, t, np.array([s, t])) for s in falls.MAP_SINKS for t in falls.MAP_TUMBLES]
    assert len(falls.map_lines(cells)) == 1 + len(falls.MAP_SINKS)


def test_velocities_are_of_the_three_kinds():
    drawn = [drawn_velocity(np.random.default_rng(seed)) for seed in range(200)]
    sinks = [-v.z for v in drawn if v.x == v.y == 0.0]
    assert all(SINKS[0] <= sink <= SINKS[1] for sink in sinks)
    assert 120 < len(sinks) < 180
    assert {round(float(np.hypot(v.x, v.y)), 6) for v in drawn} == {0.0, 12.0, 18.0}


@pytest.mark.parametrize("windy", [False, True])
def test_the_whole_vehicle_comes_home_and_one_seed_is_one_fall(windy):
    flown = falls.fly(2, Craft("nominal", Navigation.TRUTH), windy=windy)
    assert flown.end is FallEnd.HOME
    assert flown == falls.run(1, 2, Craft("nominal", Navigation.TRUTH), windy=windy)[0]


def test_the_summary_names_what_did_not_come_home():
    rows = [
        AircraftFall(seed, Vector(0.0, 0.0, -9.0), end, 20.0, 9.0, 0.1, ("catch_fall",))
        for seed, end in enumerate((FallEnd.HOME, FallEnd.CRASHED, FallEnd.LATE))
    ]
    text = "\n".join(falls.aircraft_summary(rows))
    assert "1 crashed, 1 of 3 (0.8 to 90.6 %) home" in text
    assert "crashed: seed 1: thrown at (0.0, 0.0, -9.0) m/s, 20 m lost" in text
    assert "late: seed 2" in text


@pytest.mark.parametrize(("flights", "first"), [(0, 1), (3, -1)])
def test_a_study_of_nothing_is_refused(flights, first):
    with pytest.raises(SitlError):
        falls.heights(NOMINAL, flights, first)


# ``darko-sitl study falls`` and ``landings``: when they pass, what they write, what they refuse before any flight.


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
    assert out.count("1 falls from 120 m, seeds 3 to 3: 0 crashed, 1 of 1 (2.5 to 100 %) home") == 2
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
