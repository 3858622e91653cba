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
    least_inside,
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
            np.full(9, 0.04), np.full(9, 0.01), squares, scalars, 0.6,
        )
        for seed in range(number)
    ]  # fmt: skip


def test_the_verdict_tells_a_filter_that_is_right_from_one_that_is_too_sure_or_too_cautious():
    right, sure, shy = verdict(flights()), verdict(flights(1.3)), verdict(flights(0.7))
    assert right.low < right.mean < right.high
    assert right.low < ALL_ERRORS.stop < right.high
    assert right.shares.hold
    assert (sure.shares.above, sure.shares.hold, sure.shares.are_not_too_sure) == (1.0, False, False)
    assert (shy.shares.below, shy.shares.hold, shy.shares.are_not_too_sure) == (1.0, False, True)


def test_looks_are_judged_one_by_one():
    """A filter too sure in half of the looks and too cautious in the others is right in the mean."""
    half = np.where(np.arange(20) % 2 == 0, 1.4, 0.6)
    wrong = [flight._replace(nees=flight.nees * half[:, None]) for flight in flights()]
    told = verdict(wrong)
    assert told.low < told.mean < told.high
    assert told.shares.above == told.shares.below == 0.5
    assert not told.shares.hold


@pytest.mark.parametrize(("looks", "inside"), [(25, 21), (100, 90), (1, 0)])
def test_of_few_looks_chance_takes_more(looks, inside):
    assert least_inside(looks) * looks == pytest.approx(inside)


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
    assert [told.shares.inside for told in few] == [1.0, 1.0, 1.0]
    assert [told.holds for told in many] == [True, False, False]  # by a tenth too large and too small


def test_more_flights_make_the_bounds_narrower():
    few, many = verdict(flights(number=20)), verdict(flights(number=200))
    assert many.high - many.low < 0.4 * (few.high - few.low)


def test_the_summary_has_phases_by_model_and_only_the_instruments_that_read():
    lines = summary([*flights(number=2), *flights(number=2, phase=Phase.CRUISE, wrong=True)])
    assert lines[0].startswith("model right, 18 errors")
    assert lines[1].startswith("  hover        NEES of all 18")
    assert "NEES of the 15 without the wind" in lines[2]
    assert "NEES of the wind" in lines[3]
    assert "error 0.346 (said 0.173) m" in lines[4]
    assert lines[4].endswith("gusts believed 0.60 m/s")
    told = [part.split(" (")[0] for part in lines[5].split("NIS (looks inside): ")[1].split(", ")]
    assert told == ["magnetometer 1.00", "barometer 1.10", "GNSS 0.90"]
    assert lines[6].startswith("model 10 % wrong")
    assert lines[7].split()[0] == "cruise"


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


RIGHT = (18.0, 15.0, 3.0)
READ = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)


def judged(monkeypatch, nees, *more, wrong=RIGHT, nis=READ):
    """The exit code for flights whose filters are all so wrong: of all errors, without the wind, of the wind.

    Args:
        monkeypatch: Of the test.
        nees: With the right model.
        more: Arguments of the command.
        wrong: With a wrong model.
        nis: Of the instruments and the wing, with the right model.
    """

    def run(seeds, craft, jobs, on_progress, gusts):
        draws = [ConsistencyDraw(seed, phase, bad, gusts) for bad in (False, True) for phase in Phase for seed in seeds]
        lines = np.tile([50.0, 50.0, 50.0, 50.0, 0.0, 0.0, 100.0], (4, 1))
        return [
            ConsistencyFlight(
                draw, np.tile(wrong if draw.wrong else nees, (5, 1)), np.ones(9), np.ones(9),
                lines * (READ if draw.wrong else nis), lines, 0.5,
            )
            for draw in draws
        ]  # fmt: skip

    monkeypatch.setattr(consistency, "run", run)
    return main(["study", "consistency", "--flights", "4", "--jobs", "1", *more])


@pytest.mark.parametrize(
    "nees",
    [(28.0, 15.0, 3.0), (18.0, 25.0, 3.0), (18.0, 15.0, 9.0), (10.0, 15.0, 3.0), (18.0, 8.0, 3.0), (18.0, 15.0, 0.5)],
)
def test_too_sure_and_too_cautious_are_both_wrong(nees, monkeypatch, capsys):
    assert judged(monkeypatch, nees) == 1
    assert "outside (at least" in capsys.readouterr().out


def test_a_filter_that_is_as_wrong_as_it_says_holds(monkeypatch, capsys):
    assert judged(monkeypatch, RIGHT) == 0
    said = capsys.readouterr().out
    assert "NEES of all 18 18.00" in said
    assert said.rstrip().endswith("all hold")


@pytest.mark.parametrize(("wrong", "code"), [((71.0, 59.0, 11.9), 0), ((73.0, 15.0, 3.0), 1), ((18.0, 15.0, 12.1), 1)])
def test_with_a_wrong_model_it_may_be_surer_by_so_much(wrong, code, monkeypatch):
    assert judged(monkeypatch, RIGHT, wrong=wrong) == code


@pytest.mark.parametrize(("line", "factor", "code"), [(0, 1.5, 1), (3, 0.6, 1), (6, 0.3, 0), (6, 1.5, 1)])
def test_every_instrument_is_judged_on_both_sides_and_the_wing_on_one(line, factor, code, monkeypatch, capsys):
    assert judged(monkeypatch, RIGHT, nis=np.where(np.arange(7) == line, factor, 1.0)) == code
    assert (f"NIS of {LINE_NAMES[line]}" in capsys.readouterr().out) == bool(code)


def test_every_flight_is_written(monkeypatch, tmp_path):
    path = tmp_path / "consistency.json"
    assert judged(monkeypatch, RIGHT, "--gusts", "1.5", "--json", str(path)) == 0
    written = json.loads(path.read_text())
    assert "gusts=1.5" in written[0]["draw"]
    assert len(written) == 4 * len(Phase) * 2
    assert written[0]["nees"] == [18.0] * 5
