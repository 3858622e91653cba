"""The seeded campaign: complete, repeatable, and the same however many processes fly it."""

import json

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.errors import SitlError
from sitl.lab.studies import campaign
from sitl.lab.studies.campaign import MIN_FLIGHT_HEIGHT, SCALED_WITH, Spread, corner, draw, fly, passed, run, summary
from sitl.lab.studies.seeded_flights import Craft
from sitl.lab.studies.wrong_models import UNCERTAIN, perturbed
from sitl.model.airframe_files import load

SEEDS = 4


@pytest.fixture(scope="module")
def results():
    return run(SEEDS, jobs=1)


@pytest.mark.long
def test_four_flights_complete_and_stay_above_the_minimum_height(results):
    assert [result.fault for result in results] == [""] * SEEDS
    assert min(result.lowest for result in results) > MIN_FLIGHT_HEIGHT


@pytest.mark.long
def test_the_figures_are_those_of_a_square_in_forward_flight(results):
    for result in results:
        assert 20.0 < result.time < 120.0
        assert 1e3 < result.energy < 12e3
        assert 0.0 < result.cross_track < 15.0
        assert result.jumps >= 1  # from the proved hover to INDI
        assert result.failsafes == 0


@pytest.mark.long
def test_one_seed_is_one_flight(results):
    assert fly(draw(3, Spread())) == results[2]


@pytest.mark.long
def test_the_number_of_processes_changes_nothing(results):
    assert run(2, first=2, jobs=2) == results[1:3]


def test_every_seed_draws_within_the_spread_and_no_two_are_alike():
    spread = Spread(wind=3.0, gusts=0.5, parameters=0.05, airspeeds=(10.0, 11.0))
    draws = [draw(seed, spread) for seed in range(200)]
    assert max(d.wind_speed for d in draws) <= 3.0
    assert max(d.gusts for d in draws) <= 0.5
    assert all(10.0 <= d.airspeed <= 11.0 for d in draws)
    scales = np.array([[d.scale[name] for name in UNCERTAIN] for d in draws])
    assert 0.95 <= scales.min() < 0.951
    assert 1.049 < scales.max() <= 1.05
    assert len({d.azimuth for d in draws}) == len(draws)


def test_a_perturbed_airframe_differs_only_in_the_uncertain_parameters():
    model = load("collage").parameters
    other = perturbed(model, draw(5, Spread()).scale)
    changed = {name for name in model._fields if getattr(model, name) != getattr(other, name)}
    scaled = {*UNCERTAIN, *(also for group in SCALED_WITH.values() for also in group)}
    assert changed == {name for name in scaled if getattr(model, name) != 0.0}
    assert other.k_fv / other.k_f == pytest.approx(model.k_fv / model.k_f)  # still one propeller


@pytest.mark.long
def test_the_aircraft_that_was_built_flies_the_square_in_a_wind_from_its_side():
    """Edge-on to that wind it is pushed by its propellers' discs, which the laws count on: else it stays 0.7 m off."""
    flown = campaign.fly(draw(4, Spread()), Craft("darko"))
    assert flown.draw.wind_speed > 4.5
    assert flown.complete, flown.fault


def test_the_square_closes_and_has_sides_of_a_hundred_metres_whatever_its_azimuth():
    for azimuth in (0.0, 1.0, 4.0):
        points = np.array([corner(i, azimuth) for i in range(5)])
        assert np.linalg.norm(np.diff(points, axis=0), axis=1) == pytest.approx(100.0)
        assert points[4] == pytest.approx(points[0])


@pytest.mark.parametrize(("flights", "jobs"), [(0, 1), (-3, 1), (2, 0)])
def test_a_campaign_without_flights_or_processes_is_refused(flights, jobs):
    with pytest.raises(SitlError, match="at least 1"):
        run(flights, jobs=jobs)


@pytest.mark.long
def test_the_summary_counts_the_complete_and_names_the_seeds_of_the_others(results):
    lost = results[2]._replace(complete=False, fault="came down to 1.2 m", lowest=1.2)
    lines = "\n".join(summary([*results[:2], lost, *results[3:]]))
    assert f"complete: {SEEDS - 1} of {SEEDS} (19.4 to 99.4 %)" in lines
    assert "lowest of all: 1.2 m" in lines
    assert f"failed: seed {lost.draw.seed}: came down to 1.2 m" in lines


# ``darko-sitl study campaign``: what it writes, when it passes, and what it refuses before any flight.


@pytest.fixture(scope="module")
def flight():
    """One flight without wind, and its ground track."""
    return campaign.fly_and_track(draw(1, Spread(wind=0.0, gusts=0.0, parameters=0.0)))


def test_the_ground_track_belongs_to_the_flight(flight):
    result, track = flight
    assert result.complete, result.fault
    assert result.lowest == track.position[:, 2].min()
    assert np.linalg.norm(track.position[-1, :2]) < 3.0
    assert 0.0 < track.forward.mean() < 1.0


def test_too_few_complete_flights_or_one_too_low_fail_the_campaign(flight):
    good = flight[0]
    bad = good._replace(complete=False, fault="at item 3 after 240 s")
    assert passed([good] * 100, MIN_FLIGHT_HEIGHT)
    assert passed([good] * 97 + [bad] * 3, MIN_FLIGHT_HEIGHT)
    assert not passed([good] * 96 + [bad] * 4, MIN_FLIGHT_HEIGHT)
    assert not passed([good] * 99 + [good._replace(lowest=4.9)], MIN_FLIGHT_HEIGHT)


@pytest.mark.long
def test_the_command_writes_figures_plot_and_table(tmp_path, capsys):
    plot, table = tmp_path / "c.png", tmp_path / "c.json"
    arguments = [
        "study",
        "campaign",
        "--flights",
        "1",
        "--first",
        "2",
        "--jobs",
        "1",
        "--plot",
        str(plot),
        "--json",
        str(table),
    ]
    assert main(arguments) == 0
    out, err = capsys.readouterr()
    assert out.startswith("1 flights, seeds 2 to 2\n")
    assert err == "1/1 flown\n"
    assert plot.read_bytes().startswith(b"\x89PNG")
    row = json.loads(table.read_text())[0]
    assert row["draw"]["seed"] == 2
    assert row["complete"] is True


@pytest.mark.long
def test_the_plot_has_tracks_of_the_airframe_that_was_asked_for(flight, tmp_path, monkeypatch):
    flown = []
    monkeypatch.setattr(campaign, "run", lambda *_, **__: [flight[0]])
    monkeypatch.setattr(campaign, "fly_and_track", lambda _, craft: flown.append(craft.airframe) or flight)
    assert (
        main(["study", "campaign", "--flights", "1", "--airframe", "nominal", "--plot", str(tmp_path / "c.png")]) == 0
    )
    assert flown == ["nominal"]


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
