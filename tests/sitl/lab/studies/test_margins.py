"""Margins of delay and noise: what is flown, how it is judged, and a tiny map of it."""

import json
import math

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.lab.studies import margins
from sitl.lab.studies.margins import (
    DELAYS,
    INDI_MANOEUVRES,
    NOISE_FACTORS,
    REPORT_MANOEUVRES,
    MarginDraw,
    MarginFlight,
    MarginManoeuvre,
    grid,
    started,
    summary,
)
from sitl.lab.studies.seeded_flights import Craft
from sitl.lab.studies.wrong_models import NOISES, noisier
from sitl.sensors.sensor_files import load_sensors
from tests.support.flights.sensed_flights import MOCAP

CRAFT = Craft(navigation=MOCAP)


def test_only_the_noise_grows_and_the_pipeline_is_slowed():
    before, after = load_sensors(), noisier(load_sensors(), 4.0, 0.03)
    assert after.pipeline.latency == 0.03
    for name, part in before._asdict().items():
        if name != "pipeline":
            wanted = {key: 4.0 * value if key in NOISES else value for key, value in part._asdict().items()}
            assert getattr(after, name)._asdict() == wanted, name
    changed = {key for part in before for key in part._fields if key in NOISES}
    assert changed == set(NOISES)


@pytest.mark.parametrize(("controller", "manoeuvres"), [("report", REPORT_MANOEUVRES), ("indi", INDI_MANOEUVRES)])
def test_the_map_has_every_manoeuvre_delay_and_factor_by_every_seed(controller, manoeuvres):
    draws = grid(range(4, 6), controller=controller)
    assert len(draws) == len(set(draws)) == len(manoeuvres) * len(DELAYS) * len(NOISE_FACTORS) * 2
    assert {draw.manoeuvre for draw in draws} == set(manoeuvres)
    assert {draw.seed for draw in draws} == {4, 5}


@pytest.mark.parametrize("manoeuvre", [MarginManoeuvre.HOVER_LINEAR, MarginManoeuvre.HOVER_ZERO_MOMENT])
def test_a_hover_on_time_converges_and_a_seed_is_one_flight(manoeuvre):
    draw = MarginDraw(1, manoeuvre, 0.0, 1.0)
    flown = margins.fly(draw, CRAFT)
    assert flown.converged
    assert flown.fault == ""
    assert flown.error < 0.1
    assert 0.0 < flown.activity < 100.0
    assert margins.fly(draw, CRAFT) == flown


def test_noise_makes_the_elevons_busier():
    quiet, loud = (margins.fly(MarginDraw(1, MarginManoeuvre.HOVER_ZERO_MOMENT, 0.0, x), CRAFT) for x in (1.0, 8.0))
    assert loud.activity > 1.5 * quiet.activity


def test_a_vehicle_that_knows_everything_far_too_late_is_lost(monkeypatch):
    """A tenth of a second is what can be asked for, and more than the attitude loop bears."""
    monkeypatch.setattr(margins, "HOVER_SECONDS", 20.0)
    flown = margins.fly(MarginDraw(1, MarginManoeuvre.HOVER_LINEAR, 0.1, 1.0), CRAFT)
    assert not flown.converged
    assert "m away" in flown.fault or flown.fault == "diverged"


def test_flights_are_flown_in_order_by_however_many_processes(monkeypatch):
    monkeypatch.setattr(margins, "HOVER_SECONDS", 11.0)
    draws, told = [MarginDraw(seed, MarginManoeuvre.HOVER_LINEAR, 0.0, 1.0) for seed in (2, 1)], []
    flown = margins.run(draws, CRAFT, 1, told.append)
    assert [flight.draw for flight in flown] == draws
    assert told == [1, 2]


def flight(manoeuvre=MarginManoeuvre.HOVER_LINEAR, delay=0.0, noise=1.0, *, error=0.25, fault=""):
    draw = MarginDraw(1, manoeuvre, delay, noise)
    return MarginFlight(draw, not fault, error, math.radians(30.0), fault)


def test_the_summary_is_a_map_of_each_manoeuvre():
    flown = [
        flight(),
        flight(error=0.35),
        flight(delay=0.02, fault="40 m away"),
        flight(MarginManoeuvre.FORWARD, noise=2.0),
    ]
    lines = summary(flown)
    assert lines[0].startswith("hover, linear law: converged / flown")
    assert lines[1].split() == ["noise", "0", "ms", "20", "ms"]
    assert lines[2].split() == ["1x", "2/2", "0.30", "30", "0/1"]
    assert lines[4].startswith("transitions and cruise")
    assert lines[6].split() == ["2x", "1/1", "0.25", "30"]


class Flown:
    """A recording along the leg, by its distances over time."""

    def __init__(self, north, up, speed):
        n = len(north)
        self.position = np.column_stack([north, np.zeros(n), up])
        self.velocity = np.column_stack([speed, np.zeros(n), np.zeros(n)])
        self.actuators = np.zeros((n, 4))


def judged(end=margins.MARGIN_LEG, *, low_at=None, speed=15.0):
    north = np.linspace(0.0, end, 100)
    up = np.full(100, margins.MARGIN_HEIGHT)
    if low_at is not None:
        up[np.searchsorted(north, low_at)] -= margins.MAX_HEIGHT_ERROR + 1.0
    fast = np.where((north > 20.0) & (north < end - 20.0), speed, 0.0)
    return margins._judged_leg(MarginDraw(1, MarginManoeuvre.FORWARD, 0.0, 1.0), Flown(north, up, fast))


def test_a_leg_is_judged_by_where_it_went_wrong_first():
    assert judged().converged
    assert judged(speed=5.0).fault == "front transition"
    assert judged(low_at=10.0).fault == "front transition"
    assert judged(low_at=150.0).fault == "cruise"
    assert judged(low_at=margins.MARGIN_LEG - 30.0).fault == "back transition"
    assert judged(end=margins.MARGIN_LEG + 30.0).fault == "back transition"
    assert judged(low_at=150.0).error > judged().error == 0.0


# ``darko-sitl study margins``: its arguments, its verdict, and its file.


FEW = ["study", "margins", "--flights", "1", "--jobs", "1", "--nav", "mocap"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--delay", "0.2"], "--delay 0.2 is not within 0 and 0.1"),
        (["--delay", "0.01", "-0.01"], "--delay -0.01 is not within 0 and 0.1"),
        (["--noise", "101"], "--noise 101 is not within 0 and 100"),
        (["--noise", "-1"], "--noise -1 is not within 0 and 100"),
        (["--flights", "0"], "--flights 0: there must be at least 1"),
        (["--first", "-1"], "--first -1: seeds are not negative"),
        (["--sensors", "/nowhere/own.toml"], "/nowhere/own.toml: No such file"),
        (["--json", "/nowhere/margins.json"], "/nowhere/margins.json: there is no folder /nowhere"),
    ],
)
def test_bad_arguments_are_refused_before_any_flight(arguments, message, capsys):
    assert main(["study", "margins", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert "Traceback" not in said


@pytest.fixture
def flown(monkeypatch):
    """The draws that were asked for; those above a delay do not converge."""
    asked = []

    def run(draws, craft, jobs, on_progress):
        asked.extend(draws)
        return [MarginFlight(draw, draw.delay < 0.05, 0.1, math.radians(20.0), "") for draw in draws]

    monkeypatch.setattr(margins, "run", run)
    return asked


def test_the_verdict_asks_for_forty_milliseconds_at_the_specified_noise(flown, monkeypatch, capsys):
    assert main([*FEW, "--delay", "0", "0.04", "0.06", "--noise", "1", "4"]) == 0
    assert {draw.delay for draw in flown} == {0.0, 0.04, 0.06}
    assert {draw.noise for draw in flown} == {1.0, 4.0}
    assert "0/1" in capsys.readouterr().out
    monkeypatch.setattr("sitl.lab.studies.margins.SURVIVED_DELAY", 0.06)
    assert main([*FEW, "--delay", "0.06", "--noise", "1"]) == 1


def test_every_flight_is_written(flown, tmp_path):
    path = tmp_path / "margins.json"
    assert main([*FEW, "--delay", "0.01", "--noise", "2", "--json", str(path)]) == 0
    written = json.loads(path.read_text())
    assert len(written) == len(flown) == 2
    assert written[0]["draw"] == {
        "seed": 1, "manoeuvre": "hover, INDI", "delay": 0.01, "noise": 2.0, "told": True,
    }  # fmt: skip


def test_thirty_milliseconds_are_asked_for_that_the_vehicle_does_not_know(flown, monkeypatch, capsys):
    assert main([*FEW, "--untold", "--delay", "0.03", "0.06", "--noise", "1"]) == 0
    assert not any(draw.told for draw in flown)
    assert "up to 30 ms at the specified noise: 2 of 2 (15.8 to 100 %) converge" in capsys.readouterr().out
    monkeypatch.setattr("sitl.lab.studies.margins.SURVIVED_UNTOLD", 0.06)
    assert main([*FEW, "--untold", "--delay", "0.06", "--noise", "1"]) == 1


def test_what_is_not_told_changes_the_actuators_and_not_the_gains():
    draw = MarginDraw(1, MarginManoeuvre.FORWARD, 0.03, 1.0)
    known, unknown, none = (started(d, Craft()) for d in (draw, draw._replace(told=False), draw._replace(delay=0.0)))
    gains = [vehicle.design.gains.line_of_sight.attitude.x for vehicle in (known, unknown, none)]
    assert gains[0] < gains[1] == gains[2]
    late = [float(v.avionics.instruments.specification.pipeline.latency) for v in (known, unknown, none)]
    assert late == [0.03, 0.03, 0.0]
