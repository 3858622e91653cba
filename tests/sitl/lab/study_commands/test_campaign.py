"""``darko-sitl study campaign``: what it writes, when it passes, and what it refuses before any flight."""

import json

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.lab.studies import campaign
from sitl.lab.studies.campaign import MIN_FLIGHT_HEIGHT, Spread, draw, passed


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
