"""The campaign: what a seed draws, one flight of it, and what counts as passed."""

import json
import math

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.airframe import load
from sitl.commands.campaign import passed
from sitl.studies import campaign
from sitl.studies.campaign import LOWEST, Spread, draw, perturbed


@pytest.fixture(scope="module")
def flight():
    """One flight without wind, and where it went."""
    return campaign.flown(draw(1, Spread(wind=0.0, gusts=0.0, parameters=0.0)))


def test_a_seed_is_a_draw_and_another_seed_another():
    assert draw(7, Spread()) == draw(7, Spread())
    assert draw(7, Spread()) != draw(8, Spread())


def test_draws_stay_within_the_spread():
    spread = Spread(wind=3.0, gusts=0.5, parameters=0.2)
    for seed in range(50):
        drawn = draw(seed, spread)
        assert 0.0 <= drawn.wind_speed <= 3.0
        assert 0.0 <= drawn.gusts <= 0.5
        assert all(0.8 <= factor <= 1.2 for factor in drawn.scale.values())


def test_a_scaled_airframe_differs_in_what_is_scaled_alone():
    nominal = load("nominal").parameters
    heavier = perturbed(nominal, {"m": 1.1})
    assert heavier.m == pytest.approx(1.1 * nominal.m)
    assert heavier._replace(m=nominal.m) == nominal


def test_the_square_is_flown_in_calm_air(flight):
    result, track = flight
    assert result.complete, result.fault
    assert result.failsafes == 0
    assert result.lowest == track[:, 2].min() > LOWEST
    home = np.array(campaign.corner(0, result.draw.azimuth))
    assert np.linalg.norm(track[-1, :2] - home) < 3.0
    for i in range(1, 4):  # every corner is rounded within the radius of a turn
        corner = np.array(campaign.corner(i, result.draw.azimuth))
        assert np.linalg.norm(track[:, :2] - corner, axis=1).min() < 30.0


def test_too_few_complete_or_one_too_low_is_not_passed(flight):
    good = flight[0]
    bad = good._replace(complete=False, fault="at item 3 after 240 s")
    assert passed([good] * 100, LOWEST)
    assert passed([good] * 97 + [bad] * 3, LOWEST)
    assert not passed([good] * 96 + [bad] * 4, LOWEST)
    assert not passed([good] * 99 + [good._replace(lowest=4.9)], LOWEST)


def test_the_summary_names_the_seed_of_a_failure(flight):
    good = flight[0]
    lines = campaign.summary([good, good._replace(complete=False, fault="at item 3 after 240 s")])
    assert "complete: 1 (50.0 %)" in lines
    assert lines[-1].startswith("failed: seed 1: at item 3 after 240 s (wind 0.0 m/s")


def test_the_command_writes_figures_plot_and_table(tmp_path, capsys):
    plot, table = tmp_path / "c.png", tmp_path / "c.json"
    arguments = ["campaign", "--flights", "1", "--first", "2", "--jobs", "1", "--plot", str(plot), "--json", str(table)]
    assert main(arguments) == 0
    out, err = capsys.readouterr()
    assert out.startswith("1 flights, seeds 2 to 2\n")
    assert err == "1/1 flown\n"
    assert plot.read_bytes().startswith(b"\x89PNG")
    row = json.loads(table.read_text())[0]
    assert row["draw"]["seed"] == 2
    assert row["complete"] is True
    assert math.isfinite(row["time"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--flights", "0"], "0 flights by 2 processes"),
        (["--first", "-1"], "seeds are not negative"),
        (["--wind", "nan"], "--wind nan is not within"),
        (["--parameters", "0.9"], "--parameters 0.9 is not within"),
        (["--plot", "c.txt"], "plots are .png"),
        (["--json", "/nosuch/c.json"], "there is no folder /nosuch"),
    ],
)
def test_bad_arguments_are_said_before_anything_flies(arguments, words, capsys):
    assert main(["campaign", *arguments]) == 2
    err = capsys.readouterr().err
    assert words in err
    assert len(err.splitlines()) == 1
