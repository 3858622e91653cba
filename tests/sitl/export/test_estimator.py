"""The exported navigation filter and ours over the same flights on sensors: the same bits; in floats nearly so."""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from sitl.control.reference import along, hover_at, leg
from sitl.errors import SitlError
from sitl.estimation.filter import new_filter
from sitl.export.build import shared_library
from sitl.export.estimator import navigation_of
from sitl.export.flat import flattened
from sitl.export.navigated_again import HEAD, READING, FlatEstimator, compared_navigation, record_navigation
from sitl.export.random_navigation import random_navigation
from sitl.export.single_precision import ESTIMATE_PARTS, estimate_differences
from sitl.sensors.instruments import (
    ACCELEROMETER,
    BAROMETER,
    GARBAGE,
    GNSS,
    GYROSCOPE,
    MAGNETOMETER,
    MOTION_CAPTURE,
    OFF,
    PITOT,
    STUCK,
    WRONG,
)
from sitl.sensors.sensor_files import load_sensors
from tests.support.exported import AIRFRAME, DESIGN, estimator, estimator_files, folder, need
from tests.support.flights.sensed_flights import MOCAP, NOMINAL, SENSORS, UP, hovering, on_ground

PERIODS = 300
TRUTHFUL = load_sensors("truthful")


class Case(NamedTuple):
    """A flight on sensors, and whether the export of the arena navigates it."""

    name: str
    begin: object
    asks: tuple = ()


def fails(instrument, way):
    def ask(made):
        made.avionics.instruments.failures[instrument] = way
        made.avionics.instruments.failed_at[instrument] = made.periods

    return ask


def takes_off(made):
    made.armed = made.flying = True
    made.reference = hover_at((0.0, 0.0, 3.0), 0.0)


def flies_a_leg(made):
    made.reference = along(hover_at((0.0, 0.0, UP), 0.0), leg((0.0, 0.0, UP), (90.0, 20.0, UP + 4.0), 14.0), 0.0)


CASES = (
    Case("calm", lambda: hovering(SENSORS, 1, gusts=0.0, wind=(0.0, 0.0, 0.0))),
    Case("gusty, then a leg", lambda: hovering(SENSORS, 2, gusts=0.8), ((40, flies_a_leg),)),
    Case("aligned on the ground, take-off", lambda: on_ground(SENSORS, 3, aligned=False), ((600, takes_off),)),
    Case("instruments askew", lambda: hovering(SENSORS, 4, sensors=TRUTHFUL)),
    Case("the gyroscope sticks", lambda: hovering(SENSORS, 5), ((60, fails(GYROSCOPE, STUCK)),)),
    Case("the accelerometer fails", lambda: hovering(SENSORS, 6), ((60, fails(ACCELEROMETER, OFF)),)),
    Case("satellites leap", lambda: hovering(SENSORS, 7), ((60, fails(GNSS, WRONG)),)),
    Case(
        "field and tube", lambda: hovering(SENSORS, 8), ((50, fails(MAGNETOMETER, GARBAGE)), (90, fails(PITOT, STUCK)))
    ),
    Case("height is wrong", lambda: hovering(SENSORS, 9), ((60, fails(BAROMETER, WRONG)),)),
    Case("motion capture, gusty", lambda: hovering(MOCAP, 10)),
    Case("motion capture leaps", lambda: hovering(MOCAP, 11), ((60, fails(MOTION_CAPTURE, WRONG)),)),
    Case("aligned by poses", lambda: on_ground(MOCAP, 12, aligned=False), ((600, takes_off),)),
)


@cache
def recorded(case, periods=PERIODS):
    last = max((time for time, _ in case.asks), default=0)
    return record_navigation(case.name, case.begin(), max(periods, last + 150), case.asks)


@pytest.mark.long
@pytest.mark.parametrize(("cc", "level"), [("gcc", "-O0"), ("gcc", "-O2"), ("clang", "-O0"), ("clang", "-O2")])
def test_estimates_are_the_same_by_every_compiler(cc, level):
    code = estimator(cc, level)
    found = [compared_navigation(recorded(case), code) for case in CASES]
    assert all(one.is_none for one in found), [one for one in found if not one.is_none]
    assert all(one.readings > 50 for one in found)


@pytest.mark.long
@pytest.mark.parametrize("navigation", [SENSORS, MOCAP])
def test_flights_of_chance_with_failures_are_navigated_the_same(navigation):
    code = estimator("gcc", "-O2", arena=navigation is MOCAP)
    for number in range(5):
        flight = random_navigation(number, 3.0, AIRFRAME, load_sensors(), navigation)
        assert compared_navigation(flight, code).is_none, flight.name


@pytest.mark.long
@pytest.mark.parametrize("arena", [False, True])
def test_a_new_filter_begins_as_here(arena):
    settings = navigation_of(load_sensors(), DESIGN.gains.wind, arena=arena).settings
    code = estimator(arena=arena)
    ours = flattened(new_filter(settings, NOMINAL))
    assert (code.initial(ours, has_tube=True) == ours).all()
    assert code.is_in_arena == arena


@pytest.mark.long
def test_a_changed_bit_of_a_reading_is_found():
    flight = recorded(CASES[0], 60)
    rows = flight.rows.copy()
    rows[20, 1] += 1e-12
    found = compared_navigation(flight._replace(rows=rows), estimator())
    assert found.first == 20
    assert found.numbers > 0


@pytest.mark.long
def test_what_is_no_reading_is_refused_and_changes_nothing():
    flight, code = recorded(CASES[0], 60), estimator()
    clean, _ = code.navigate(flight)
    rows = flight.rows.copy()
    for wrong in ((GNSS, 0.0, 0.0, np.nan), (1, 0.0, 0.0, 1.0), (9, 0.0, 0.0, 1.0), (GNSS, -1.0, 0.0, 1.0)):
        row = rows[30]
        place = HEAD + int(row[HEAD - 1]) * READING
        row[place : place + 4] = wrong
        row[HEAD - 1] += 1.0
    seen, _ = code.navigate(flight._replace(rows=rows))
    assert (seen == clean).all()


@pytest.mark.long
def test_an_inertial_reading_that_is_no_number_is_bridged():
    flight, code = recorded(CASES[0], 60), estimator()
    clean, _ = code.navigate(flight)
    rows = flight.rows.copy()
    rows[30, 1:7] = np.nan
    rows[31, 7] = np.inf
    seen, _ = code.navigate(flight._replace(rows=rows))
    assert np.isfinite(seen).all()
    assert 0.0 < np.abs(seen - clean)[:, :3].max() < 0.01


# Of a component: the largest differences of 12 s on sensors or by motion capture are under a tenth of these.
MOST = {"position": 0.01, "velocity": 0.01, "attitude": 1e-4, "rates": 1e-4, "wind": 0.01, "on_ground": 0.5}


@pytest.mark.long
@pytest.mark.parametrize("arena", [False, True])
def test_floats_estimate_nearly_the_same(arena):
    code = estimator(arena=arena, single=True)
    assert code.is_single
    for case in (CASES[9],) if arena else CASES[:3]:
        names = [name for name, _, _ in ESTIMATE_PARTS]
        apart = dict(zip(names, estimate_differences(recorded(case), code), strict=True))
        assert all(apart[name] < most for name, most in MOST.items()), (case.name, apart)
        assert apart["position"] > 0.0


@pytest.mark.long
def test_floats_do_not_drift_away_in_a_long_flight():
    long_hover = recorded(Case("long", lambda: hovering(SENSORS, 2)), 10_000)
    estimates, _ = estimator(single=True).navigate(long_hover)
    apart = np.abs(estimates - long_hover.estimates)[:, :3].max(axis=1)
    assert apart[-500:].max() < 0.0005  # a tenth of that; 3 mm where roundings add up, the square of the time


@pytest.mark.long
def test_an_export_without_an_estimator_says_so():
    need("cc")
    with pytest.raises(SitlError, match="holds no exported estimator: darko-sitl export c --estimator"):
        FlatEstimator(shared_library(folder(), options=("-O0",)))


@pytest.mark.long
def test_functions_have_their_text_and_structs_their_arrays():
    files = estimator_files()
    assert "double covariance[35][35]; /* (ERRORS, ERRORS) */" in files["darko_types.h"]
    assert "double (*P)[35]; /* covariance, (ERRORS, ERRORS) */" in files["darko_types.h"]
    assert (
        "The covariance once the attitude is corrected: its error is one from the corrected attitude (Solà, eq. 287)."
        in (files["kalman.h"])
    )
    assert "HiddenErrors" not in files["darko_types.h"]
