"""The flight before the wind wall: what the aircraft's set keeps, and how a set that misses it is told."""

import math

import pytest

from sitl import load_airframe
from sitl.lab.validation.wall_flight import FLIGHT, Comparison, SteadyFlight, compared, faults, predicted, table

DARKO = load_airframe("darko").parameters
ROWS = compared(DARKO)


def test_the_aircraft_s_set_keeps_every_limit():
    assert faults(ROWS) == []
    assert max(abs(row.pitch_error) for row in ROWS) <= 3.0
    assert math.sqrt(sum(row.pitch_error**2 for row in ROWS) / len(ROWS)) <= 2.0
    assert max(abs(row.elevon_error) for row in ROWS) <= 3.0
    assert max(abs(row.thrust_error) for row in ROWS if row.fitted) <= 0.04


def test_what_it_was_not_fitted_to_it_predicts_hardly_worse():
    held_back = [row for row in ROWS if not row.fitted]
    assert [row.flown.wind for row in held_back] == [1.74, 3.38, 4.91, 6.54]
    assert math.sqrt(sum(row.pitch_error**2 for row in held_back) / len(held_back)) <= 1.5
    assert max(abs(row.elevon_error) for row in held_back) <= 1.5


def test_only_stretches_that_are_shared_tell_the_motors():
    assert all(math.isnan(row.flown.thrust) != row.fitted for row in FLIGHT)


@pytest.mark.parametrize("name", ["collage", "published", "nominal"])
def test_the_older_sets_miss_it(name):
    assert faults(compared(load_airframe(name).parameters))


def test_the_thrust_is_the_speed_of_the_motors_in_the_flight_s_own_scale():
    at = predicted(DARKO, 0.0)
    assert (at.pitch, at.elevon) == (pytest.approx(90.0, abs=0.05), pytest.approx(0.0, abs=0.05))
    assert at.thrust == pytest.approx(1.9412e-8 * 12230.0**2, rel=0.01)


def row_off_by(pitch=0.0, elevon=0.0, thrust=1.0):
    flown = SteadyFlight(3.0, 80.0, 2.0, 2.8)
    return Comparison(flown, SteadyFlight(3.0, 80.0 + pitch, 2.0 + elevon, 2.8 * thrust), fitted=True)


@pytest.mark.parametrize(
    ("off", "told"),
    [
        ({"pitch": 3.2}, ["in 3 m/s: pitch +3.2 deg, allowed 3", "pitch 3.2 deg rms, allowed 2"]),
        ({"pitch": -2.1}, ["pitch 2.1 deg rms, allowed 2"]),
        ({"elevon": -3.1}, ["in 3 m/s: elevon -3.1 deg, allowed 3"]),
        ({"thrust": 1.041}, ["in 3 m/s: thrust +4.1 %, allowed 4"]),
        ({"pitch": 1.9, "elevon": 2.9, "thrust": 0.961}, []),
    ],
)
def test_each_limit_is_told_where_it_is_missed(off, told):
    assert faults([row_off_by(**off)]) == told


def test_a_set_without_a_trim_misses_the_pitch():
    assert faults([row_off_by(pitch=math.nan)])


def test_the_table_has_flight_and_model_side_by_side_and_says_what_was_fitted():
    lines = table([row_off_by(pitch=1.5), row_off_by(elevon=-1.0)._replace(fitted=False)])
    assert lines[2].split() == [
        "3.00",
        "80.0",
        "81.5",
        "+1.5",
        "2.0",
        "2.0",
        "+0.0",
        "2.80",
        "2.80",
        "+0.0%",
        "fitted",
        "to",
    ]
    assert lines[-2:] == [
        "fitted to: pitch 1.5 deg rms, elevons within 0.0 deg",
        "predicted: pitch 0.0 deg rms, elevons within 1.0 deg",
    ]
