"""The campaign of squares: its figures, its picture, and what its command refuses."""

import json

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.lab.campaigns.specification import draw, load_specification
from sitl.lab.studies.campaign import DRAWN_TRACKS, examples, save_plot, track
from sitl.lab.studies.seeded_flights import Craft
from sitl.lab.studies.spec_studies import run_in_memory
from sitl.lab.studies.wrong_models import SCALED_WITH, UNCERTAIN, perturbed
from sitl.model.airframe_files import load
from tests.support.campaigns import shipped

STILL = {"vary.wind.uniform": [0.0, 0.0], "vary.gusts.uniform": [0.0, 0.0], "vary.airframe.relative": 0.0}


@pytest.mark.long
def test_the_figures_are_those_of_a_square_in_forward_flight():
    flown = shipped("square", seed=1).measures
    assert flown["complete"]
    assert 20.0 < flown["duration"] < 120.0
    assert 1.0 < flown["used"] < 12.0
    assert 0.0 < flown["off_square"] < 15.0
    assert flown["jumps_made"] >= 1  # from the proved hover to INDI


@pytest.mark.long
def test_the_aircraft_that_was_built_flies_the_square_in_a_wind_from_its_side():
    """Edge-on to that wind it is pushed by its propellers' discs, which the laws count on: else it stays 0.7 m off."""
    assert draw(load_specification("square"), 3).values["wind"] > 4.5
    assert shipped("square", seed=4, craft=Craft("darko")).measures["complete"]


@pytest.mark.long
def test_the_mission_that_hovered_short_of_its_end_for_ever_is_done():
    """A wind of 2.3 m/s and a wrong model held V at 12, and the back transition handed over below 10 only."""
    flown = shipped("square", seed=7037).measures
    assert flown["complete"]
    assert flown["duration"] < 60.0


def test_a_perturbed_airframe_differs_only_in_the_uncertain_parameters():
    model = load("collage").parameters
    other = perturbed(model, draw(load_specification("square"), 4).factors)
    changed = {name for name in model._fields if getattr(model, name) != getattr(other, name)}
    scaled = {*UNCERTAIN, *(also for group in SCALED_WITH.values() for also in group)}
    assert changed == {name for name in scaled if getattr(model, name) != 0.0}
    assert other.k_fv / other.k_f == pytest.approx(model.k_fv / model.k_f)  # still one propeller


@pytest.fixture(scope="module")
def still():
    """One square without wind."""
    return run_in_memory(load_specification("square", {**STILL, "run.cases": 1, "vehicle.navigation": "truth"}), 1)


@pytest.mark.long
def test_the_track_belongs_to_the_flight(still):
    (case,) = examples(still)
    p = track(still.specification, case)
    assert still.values("lowest") == pytest.approx([p[:, 2].min()])
    assert np.linalg.norm(p[-1, :2]) < 3.0


def test_tracks_are_of_failures_first_then_of_the_greatest_overshoots(still):
    overshoots = [0.1 * (number % 5) for number in range(20)]
    names = list(still.specification.measures)

    def case(number, overshoot):
        measures = list(still.flown[0].measures)
        measures[names.index("overshoot")] = overshoot
        measures[names.index("complete")] = float(number != 7)
        return still.flown[0]._replace(number=number, measures=tuple(measures))

    many = still._replace(flown=[case(*told) for told in enumerate(overshoots)])
    drawn = [one.number for one in examples(many)]
    assert (drawn[:3], len(drawn), len(set(drawn))) == ([7, 4, 9], DRAWN_TRACKS, DRAWN_TRACKS)


@pytest.mark.long
def test_the_picture_is_drawn(still, tmp_path):
    save_plot(still, tmp_path / "c.png")
    assert (tmp_path / "c.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_the_command_writes_figures_plot_and_table(tmp_path, capsys):
    plot, table = tmp_path / "c.png", tmp_path / "c.json"
    arguments = [
        "--flights",
        "1",
        "--first",
        "2",
        "--jobs",
        "1",
        "--wind",
        "0",
        "--plot",
        str(plot),
        "--json",
        str(table),
    ]
    assert main(["study", "campaign", *arguments]) == 0
    assert capsys.readouterr().out.startswith("square: 1 cases, seeds 2 to 2\n")
    assert plot.read_bytes().startswith(b"\x89PNG")
    row = json.loads(table.read_text())[0]
    assert (row["seed"], row["wind"], row["complete"]) == (2, 0.0, True)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--flights", "0"], "--flights 0: there must be at least 1"),
        (["--first", "-1"], "seeds are not negative"),
        (["--wind", "99"], "--wind 99 is not within"),
        (["--parameters", "0.9"], "--parameters 0.9 is not within"),
        (["--plot", "c.txt"], "the name must end in .png"),
        (["--json", "/nosuch/c.json"], "there is no folder /nosuch"),
    ],
)
def test_bad_arguments_are_refused_before_any_flight(arguments, words, capsys):
    assert main(["study", "campaign", *arguments]) == 2
    err = capsys.readouterr().err
    assert words in err
    assert len(err.splitlines()) == 1
