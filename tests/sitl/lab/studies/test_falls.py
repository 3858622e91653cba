"""Falls: what is drawn, what they cost beside the law alone, and that they end at home."""

import json

import numpy as np
import pytest

from sitl import Law, SitlError, load_airframe
from sitl.__main__ import main
from sitl.lab.studies import falls
from sitl.lab.studies.falls import (
    FALL_HEIGHT,
    MAX_TUMBLE,
    SAME_HEIGHT,
    HeightLost,
    MapCell,
    fall,
    falling,
    is_caught,
    thrown,
)
from sitl.lab.studies.seeded_flights import Craft
from sitl.model.quaternions import x_axis
from sitl.simulation.avionics import Navigation
from tests.support.campaigns import shipped

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


@pytest.mark.parametrize(("flights", "first"), [(0, 1), (3, -1)])
def test_a_study_of_nothing_is_refused(flights, first):
    with pytest.raises(SitlError):
        falls.heights(NOMINAL, flights, first)


# ``darko-sitl study falls``: when it passes, what it writes; what it and ``landings`` refuse before any flight.


SAME = HeightLost("", np.array([5.0]), np.array([5.0]), np.zeros(1))


def test_no_fall_may_need_more_height_than_under_the_law_alone_or_end_elsewhere():
    assert is_caught([SAME])
    assert not is_caught([SAME, SAME._replace(supervisor=np.array([7.0]))])
    assert not is_caught([SAME._replace(away=np.array([9.0]))])


@pytest.mark.parametrize("campaign", ["falls-calm", "falls"])
def test_the_whole_vehicle_comes_home(campaign):
    assert shipped(campaign, seed=2, craft=Craft("nominal", Navigation.TRUTH)).measures["at_home"]


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
    assert "falls-calm: 1 cases, seeds 3 to 3\n" in out
    assert out.count("| 1 | 1 of 1 (2.5 to 100 %) |") == 2
    assert plot.read_bytes().startswith(b"\x89PNG")
    written = json.loads(table.read_text())
    assert len(written["heights"]) == 1
    assert len(written["map"]) == 2
    assert written["falls-calm"][0]["seed"] == written["falls"][0]["seed"] == 3


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
