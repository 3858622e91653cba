"""Consistency of the filter: its errors, the verdict by chi-squared, the summary, and one flight of each phase."""

import json

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.estimation.nominal_state import ATTITUDE_ERROR, NominalState
from sitl.lab.studies import consistency
from sitl.lab.studies.consistency import (
    ALL_ERRORS,
    LINE_NAMES,
    NAVIGATION,
    WIND,
    ConsistencyDraw,
    ConsistencyFlight,
    Phase,
    errors_of,
    fly,
    judged_innovations,
    summary,
    verdict,
)
from sitl.lab.studies.seeded_flights import DEFAULT_CRAFT
from sitl.model.quaternions import conjugate, multiply, rotate_inverse, small_rotation
from sitl.model.vectors import Vector
from sitl.storage import named_from
from tests.support.flights.ideal_sensors import WANDERING
from tests.support.flights.sensed_flights import hovering


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(consistency, "SECONDS", 8.0)
    monkeypatch.setattr(consistency, "STOP_AFTER", 6.0)


def test_the_errors_are_true_less_believed_and_the_attitude_s_in_the_body_frame():
    made = hovering(sensors=WANDERING)
    made.step(1.0)
    truth, belief = made.truth, named_from(NominalState, made.avionics.filter["nominal"].item())
    hidden = made.avionics.instruments["errors"]
    e = errors_of(made, truth, Vector(4.0, 5.0, 6.0))
    assert e[:3] == pytest.approx(np.subtract(truth.body.position, belief.position))
    assert e[3:6] == pytest.approx(np.subtract(truth.body.velocity, belief.velocity))
    turn = e[ATTITUDE_ERROR : ATTITUDE_ERROR + 3]
    off = multiply(conjugate(truth.body.attitude), multiply(belief.attitude, small_rotation(Vector(*turn))))
    assert np.array(off[1:]) == pytest.approx(np.zeros(3), abs=1e-3 * np.linalg.norm(turn))  # it is small to that
    askew = hidden["imu_misalignment"].item()
    gyro = np.add(hidden["gyro_bias"].item(), hidden["gyro_drift"].item())
    assert e[9:12] == pytest.approx(gyro - np.array(belief.gyro_bias))
    felt = rotate_inverse(truth.body.attitude, Vector(0.0, 0.0, made.airframe.g))
    accel = np.add(hidden["accel_bias"].item(), hidden["accel_drift"].item()) - np.cross(askew, felt)
    assert e[12:15] == pytest.approx(accel - np.array(belief.accel_bias))
    assert e[15:18] == pytest.approx(np.subtract((4.0, 5.0, 6.0), belief.wind))


@pytest.mark.parametrize(
    ("phase", "wrong"), [(Phase.HOVER, False), (Phase.HOVER, True), (Phase.TRANSITION, False), (Phase.CRUISE, False)]
)
def test_a_flight_of_each_phase_is_looked_at_every_second(phase, wrong, short):
    draw = ConsistencyDraw(1, phase, wrong)
    flown = fly(draw, DEFAULT_CRAFT)
    assert flown.draw == draw
    assert flown.nees.shape == (3, 3)
    assert (flown.nees > 0.0).all()
    assert (flown.nees < 20.0 * ALL_ERRORS.stop).all()  # wrong by far less than a gross mistake
    assert (flown.nees[:, 1:] < flown.nees[:, :1]).all()  # of a part, less than of all
    assert (flown.said > 0.0).all()
    assert not flown.scalars[:, LINE_NAMES.index("motion capture")].any()
    (magnetic,) = [told for told in judged_innovations([flown]) if told.name == "magnetometer"]
    assert 0.2 < magnetic.mean < 3.0
    again = fly(draw, DEFAULT_CRAFT)
    assert again.nees.tolist() == flown.nees.tolist()


def flights(scale=1.0, number=200, phase=Phase.HOVER, wrong=False):
    """Flights of a filter whose errors are wrong by a factor squared."""
    random, scalars = np.random.default_rng(1), np.tile([150.0, 50.0, 60.0, 0.0, 0.0, 0.0, 0.0], (19, 1))
    squares = scalars * (1.0, 1.1, 0.9, 0.0, 0.0, 0.0, 0.0)
    return [
        ConsistencyFlight(
            ConsistencyDraw(seed, phase, wrong), random.chisquare((18, 15, 3), (20, 3)) * (scale, 1.0, 1.0),
            np.full(9, 0.04), np.full(9, 0.01), squares, scalars,
        )
        for seed in range(number)
    ]  # fmt: skip


def test_the_verdict_tells_a_filter_that_is_right_from_one_that_is_too_sure():
    right, sure, shy = verdict(flights()), verdict(flights(1.3)), verdict(flights(0.7))
    assert right.low < right.mean < right.high
    assert right.low < ALL_ERRORS.stop < right.high
    assert right.inside > 0.7  # of twenty looks, nineteen by chance
    assert sure.mean > sure.high
    assert sure.inside == 0.0
    assert shy.mean < shy.low


@pytest.mark.parametrize(("part", "errors"), [(ALL_ERRORS, 18), (NAVIGATION, 15), (WIND, 3)])
def test_each_part_is_judged_by_the_number_of_its_errors(part, errors):
    told = verdict(flights(), part)
    assert told.low < errors < told.high
    assert told.mean == pytest.approx(errors, rel=0.05)


def test_innovations_are_judged_by_how_many_there_are():
    few, many = judged_innovations(flights(number=2)), judged_innovations(flights(number=100))
    assert [told.name for told in many] == ["magnetometer", "barometer", "GNSS"]
    for one, all_ in zip(few, many, strict=True):
        assert one.mean == pytest.approx(all_.mean)
        assert one.low < all_.low < 1.0 < all_.high < one.high
    assert [told.inside for told in few] == [1.0, 1.0, 1.0]
    assert [told.inside for told in many] == [1.0, 0.0, 0.0]  # by a tenth too large and too small


def test_more_flights_make_the_bounds_narrower():
    few, many = verdict(flights(number=20)), verdict(flights(number=200))
    assert many.high - many.low < 0.4 * (few.high - few.low)


def test_the_summary_has_phases_by_model_and_only_the_instruments_that_read():
    lines = summary([*flights(number=2), *flights(number=2, phase=Phase.CRUISE, wrong=True)])
    assert lines[0].startswith("model right, 18 errors")
    assert lines[1].split()[0] == "hover"
    assert "NEES of the 15 without the wind" in lines[2]
    assert "error 0.346 (said 0.173) m" in lines[3]
    told = [part.split(" (")[0] for part in lines[4].split("NIS: ")[1].split(", ")]
    assert told == ["magnetometer 1.00", "barometer 1.10", "GNSS 0.90"]
    assert lines[5].startswith("model 10 % wrong")
    assert lines[6].split()[0] == "cruise"


# ``darko-sitl study consistency``: its arguments, its verdict, and its file.


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--nav", "truth"], "--nav truth: there is no filter to judge"),
        (["--flights", "0"], "--flights 0: there must be at least 1"),
        (["--jobs", "0"], "--jobs 0: there must be at least 1"),
        (["--gusts", "-1"], "--gusts -1 is not within 0 and 10"),
        (["--sensors", "/nowhere/own.toml"], "/nowhere/own.toml: No such file"),
        (["--json", "/nowhere/c.json"], "/nowhere/c.json: there is no folder /nowhere"),
    ],
)
def test_bad_arguments_are_refused_before_any_flight(arguments, message, capsys):
    assert main(["study", "consistency", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert "Traceback" not in said


def judged(monkeypatch, nees, *more):
    """The exit code for flights whose filters are all so wrong: of all errors, without the wind, of the wind."""

    def run(seeds, craft, jobs, on_progress, gusts):
        draws = [
            ConsistencyDraw(seed, phase, wrong, gusts) for wrong in (False, True) for phase in Phase for seed in seeds
        ]
        lines = np.tile([50.0, 50.0, 50.0, 50.0, 0.0, 0.0, 100.0], (4, 1))
        looks = (np.tile(nees, (5, 1)), np.ones(9), np.ones(9), lines, lines)
        return [ConsistencyFlight(draw, *looks) for draw in draws]

    monkeypatch.setattr(consistency, "run", run)
    return main(["study", "consistency", "--flights", "4", "--jobs", "1", *more])


def test_the_verdict_is_whether_it_is_surer_than_it_may_be(monkeypatch, capsys):
    assert judged(monkeypatch, (18.0, 15.0, 3.0)) == 0
    assert "NEES 18.00" in capsys.readouterr().out
    assert judged(monkeypatch, (6.0, 5.0, 1.0)) == 0  # shy is not wrong
    assert judged(monkeypatch, (28.0, 15.0, 3.0)) == 1
    assert judged(monkeypatch, (18.0, 25.0, 3.0)) == 1
    assert judged(monkeypatch, (18.0, 15.0, 9.0)) == 1


def test_every_flight_is_written(monkeypatch, tmp_path):
    path = tmp_path / "consistency.json"
    assert judged(monkeypatch, (18.0, 15.0, 3.0), "--gusts", "1.5", "--json", str(path)) == 0
    written = json.loads(path.read_text())
    assert "gusts=1.5" in written[0]["draw"]
    assert len(written) == 4 * len(Phase) * 2
    assert written[0]["nees"] == [18.0] * 5
