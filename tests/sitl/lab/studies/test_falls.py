"""Falls: what is drawn, what they cost beside the law alone, and that they end at home."""

import json

import numpy as np
import pytest

from sitl import Law, load_airframe
from sitl.__main__ import main
from sitl.lab.campaigns.campaign_run import CampaignResult
from sitl.lab.campaigns.campaign_summary import quantities
from sitl.lab.campaigns.case_flights import FlownCase
from sitl.lab.campaigns.specification import load_specification
from sitl.lab.studies.falls import lost_by_kind, worse_lines
from sitl.lab.studies.seeded_flights import Craft
from sitl.lab.studies.spec_studies import FlownStudy
from sitl.model.quaternions import x_axis
from sitl.simulation.avionics import Navigation
from tests.support.campaigns import shipped
from tests.support.flights.falls import ALONE, FALL_HEIGHT, MAX_TUMBLE, fall, falling, thrown

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
    """Sixteen falls at 15 m/s under the supervisor, the height that they lose, and how far away they end."""
    flights = [falling(NOMINAL, seed, DOWN) for seed in range(16)]
    return flights, *fall(flights)


@pytest.mark.long
def test_the_supervisor_catches_a_fall_without_losing_more_height_than_the_law_alone(sixteen):
    flights, lost, _ = sixteen
    alone, _ = fall([falling(NOMINAL, seed, DOWN, tuning=ALONE) for seed in range(16)])
    assert all("catch_fall" in [jump.name for jump in flight.jumps] for flight in flights)
    assert (lost <= alone + 1.0).all()
    assert np.median(lost) < 40.0


def test_every_fall_ends_at_home_under_the_linear_law(sixteen):
    flights, _, away = sixteen
    assert (away <= 1.0).all()
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


@pytest.mark.parametrize("campaign", ["falls-calm", "falls"])
def test_the_whole_vehicle_comes_home(campaign):
    assert shipped(campaign, seed=2, craft=Craft("nominal", Navigation.TRUTH)).measures["at_home"]


# ``darko-sitl study falls``: when it passes, what it writes; what it and ``landings`` refuse before any flight.


def test_no_fall_may_need_more_height_than_by_one_law_alone():
    specification = load_specification("fall-heights", {"run.cases": 32})
    at = list(specification.measures).index("lost")

    def study(**heights):
        measures = [[5.0] * len(specification.measures) for _ in range(32)]
        for case, height in heights.items():
            measures[int(case.removeprefix("case"))][at] = height
        flown = [FlownCase(number, "time", "", tuple(values)) for number, values in enumerate(measures)]
        result = CampaignResult(specification, flown, ended_early=False)
        return FlownStudy(result, quantities(specification, range(32)), "")

    assert worse_lines(study(case0=6.0, case1=5.0)) == []
    assert worse_lines(study(case2=6.1, case19=2.0)) == [
        "thrown at 8 m/s down, 2 of 2 lose over 1 m more than by one law alone"
    ]
    assert worse_lines(study(case14=float("nan")))[0].startswith("thrown at 18 m/s level, 1 of 2")
    assert lost_by_kind(study(case18=7.0))["8 m/s down"].tolist() == [[5.0, 5.0], [7.0, 5.0]]


@pytest.mark.long
def test_falls_are_printed_drawn_and_written(tmp_path, capsys):
    plot, table = tmp_path / "f.png", tmp_path / "f.json"
    arguments = ["--flights", "1", "--draws", "1", "--first", "3", "--jobs", "1", "--controller", "report"]
    assert main(["study", "falls", *arguments, "--plot", str(plot), "--json", str(table)]) == 0
    out = capsys.readouterr().out
    assert out.startswith("fall-heights: 16 cases, seeds 3 to 3\n")
    assert "falls-calm: 1 cases, seeds 3 to 3\n" in out
    assert out.count("| 1 | 1 of 1 (2.5 to 100 %) |") == 2
    assert plot.read_bytes().startswith(b"\x89PNG")
    written = json.loads(table.read_text())
    assert {name: len(rows) for name, rows in written.items()} == {
        "fall-heights": 16, "fall-map": 30, "falls-calm": 1, "falls": 1,
    }  # fmt: skip
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
