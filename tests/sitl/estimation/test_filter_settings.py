"""The filter's assumptions about its instruments: how each error begins, grows and fades."""

import math

import numpy as np
import pytest

from sitl.design.gains import wind_gains
from sitl.estimation import filter as kept
from sitl.estimation.filter import SLOW_STEP, filter_settings, new_filter
from sitl.estimation.gust_meter import FIRST_LEVEL, FIXED_LEVEL
from sitl.estimation.nominal_state import (
    ACCEL_BIAS_ERROR,
    ARENA_ERRORS,
    ATTITUDE_ERROR,
    BAROMETER_DRIFT_ERROR,
    ERRORS,
    GNSS_DRIFT_ERROR,
    GYRO_BIAS_ERROR,
    MAGNETIC_BIAS_ERROR,
    MISALIGNMENT_ERROR,
    POSITION_ERROR,
    STATIC_PORT_ERROR,
    STEADY_WIND_ERROR,
    TUBE_BIAS_ERROR,
    TUBE_SPEED_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
    WING_ERROR,
)
from sitl.sensors.draws import Timing
from tests.support.flights.ideal_sensors import NOMINAL, SHIPPED, WANDERING

WIND = wind_gains()._replace(walk=1.7, return_time=150.0, max_deviation=2.5)
SINGLE = {TUBE_BIAS_ERROR, TUBE_SPEED_ERROR, WING_ERROR, BAROMETER_DRIFT_ERROR, STATIC_PORT_ERROR}
STEADY = np.array([WIND.max_deviation, WIND.max_deviation, 0.3])
OUTDOORS, ARENA = (filter_settings(SHIPPED, WIND, arena=arena) for arena in (False, True))


def vectors(**values):
    """Numbers of the errors that are given, 0 elsewhere."""
    made = np.zeros(ERRORS)
    for name, value in values.items():
        first = getattr(kept, f"{name.upper()}_ERROR")
        made[first : first + (1 if first in SINGLE else 3)] = value
    return made


def walk(drift, time):
    """Variance that an error of this deviation gains in a slow step, if it forgets itself in this time."""
    return 2.0 * np.square(drift) * SLOW_STEP / time


@pytest.mark.parametrize(("settings", "shaken"), [(OUTDOORS, kept.SHAKEN), (ARENA, kept.SHAKEN_IN_ARENA)])
def test_every_error_gains_what_its_instrument_is_said_to(settings, shaken):
    gyroscope, accelerometer, gnss = SHIPPED.gyroscope, SHIPPED.accelerometer, SHIPPED.gnss
    wanted = vectors(
        attitude=0.5 * SLOW_STEP * (gyroscope.noise**2 + kept.SHAKEN_TURN**2),
        velocity=0.5 * SLOW_STEP * accelerometer.noise**2,
        gyro_bias=walk(gyroscope.drift, gyroscope.drift_time),
        accel_bias=walk(accelerometer.drift, accelerometer.drift_time),
        steady_wind=walk(STEADY, kept.WEATHER_TIME),
        wing=walk(kept.LACKED_SHARE, kept.LACKED_TIME),
        gnss_drift=walk((gnss.drift_level, gnss.drift_level, gnss.drift_up), gnss.drift_time),
        barometer_drift=walk(SHIPPED.barometer.drift, SHIPPED.barometer.drift_time),
    )
    assert settings.process_noise == pytest.approx(wanted, rel=1e-12, abs=0.0)
    assert settings.shaken == pytest.approx(0.5 * SLOW_STEP * (shaken * accelerometer.vibration) ** 2, rel=1e-12)


@pytest.mark.parametrize("settings", [OUTDOORS, ARENA])
def test_what_is_forgotten_fades_with_its_time_and_all_else_stays(settings):
    gone = vectors(
        steady_wind=SLOW_STEP / kept.WEATHER_TIME,
        wing=SLOW_STEP / kept.LACKED_TIME,
        gnss_drift=SLOW_STEP / SHIPPED.gnss.drift_time,
        barometer_drift=SLOW_STEP / SHIPPED.barometer.drift_time,
    )
    assert settings.decay == pytest.approx(np.exp(-gone), rel=1e-9, abs=0.0)


def test_every_error_begins_as_large_as_its_instrument_makes_it():
    field, tilt = SHIPPED.magnetometer, SHIPPED.accelerometer.bias / 9.8
    same = {
        "gyro_bias": (0.05 * SHIPPED.gyroscope.bias) ** 2 + SHIPPED.gyroscope.drift**2,
        "accel_bias": SHIPPED.accelerometer.bias**2,
        "steady_wind": STEADY**2,
        "wing": kept.LACKED_SHARE**2,
        "tube_bias": SHIPPED.pitot.bias**2,
        "misalignment": SHIPPED.motion_capture.misalignment**2,
        "magnetic_bias": field.bias**2,
        "static_port": SHIPPED.barometer.position_error**2,
    }

    def air(level):
        return {"wind": STEADY**2 + level**2, "tube_speed": WIND.max_deviation**2 + level**2}

    turn = max(tilt, field.bias / math.hypot(field.field_north, field.field_west))
    assert np.diag(OUTDOORS.initial) == pytest.approx(
        vectors(position=0.09, velocity=0.01, attitude=turn**2, **air(FIRST_LEVEL), **same), rel=1e-12, abs=0.0
    )
    turn = max(tilt, SHIPPED.motion_capture.misalignment)
    assert np.diag(ARENA.initial) == pytest.approx(
        vectors(position=1e-4, velocity=4e-4, attitude=turn**2, **air(FIXED_LEVEL), **same), rel=1e-12, abs=0.0
    )


def test_readings_of_a_noise_that_lasts_repeat_each_other():
    """Of correlation c with the next, n of them tell as much as n (1 - c) / (1 + c) new ones."""
    gnss = WANDERING.gnss
    c = math.exp(-1.0 / (gnss.timing.rate * gnss.noise_time))
    assert filter_settings(WANDERING, WIND, arena=False).gnss_repeats == pytest.approx((1.0 + c) / (1.0 - c), rel=1e-4)
    short = WANDERING._replace(gnss=gnss._replace(noise_time=0.02))
    assert filter_settings(short, WIND, arena=False).gnss_repeats == pytest.approx(1.0, abs=0.02)
    assert OUTDOORS.gnss_repeats == 1.0


def test_axes_askew_count_as_a_bias_of_gravity_and_a_tilt():
    bias, P = (
        math.hypot(WANDERING.accelerometer.bias, 9.8 * WANDERING.mounting.misalignment),
        [np.diag(filter_settings(s, WIND, arena=True).initial) for s in (SHIPPED, WANDERING)],
    )
    assert P[1][ACCEL_BIAS_ERROR : ACCEL_BIAS_ERROR + 3] == pytest.approx(3 * [bias**2])
    assert P[1][ATTITUDE_ERROR : ATTITUDE_ERROR + 3] == pytest.approx(3 * [(bias / 9.8) ** 2])
    changed = np.flatnonzero(P[0] != P[1])
    assert set(changed) == {*range(ATTITUDE_ERROR, ATTITUDE_ERROR + 3), *range(ACCEL_BIAS_ERROR, ACCEL_BIAS_ERROR + 3)}


def test_the_wind_begins_as_the_steady_wind_with_a_gust_on_it():
    P = OUTDOORS.initial
    both = P[WIND_ERROR : WIND_ERROR + 3, STEADY_WIND_ERROR : STEADY_WIND_ERROR + 3]
    assert np.array_equal(both, np.diag(STEADY**2))
    assert np.array_equal(P, P.T)
    assert np.count_nonzero(P - np.diag(np.diag(P))) == 2 * 3


def test_the_errors_are_numbered_through():
    threes = (
        *(POSITION_ERROR, VELOCITY_ERROR, ATTITUDE_ERROR, GYRO_BIAS_ERROR, ACCEL_BIAS_ERROR, WIND_ERROR),
        STEADY_WIND_ERROR,
    )
    singles = (TUBE_BIAS_ERROR, TUBE_SPEED_ERROR, WING_ERROR)
    later = (*(MISALIGNMENT_ERROR, MAGNETIC_BIAS_ERROR, GNSS_DRIFT_ERROR),)
    assert (*threes, *singles) == (*range(0, 19, 3), 21, 22, 23)
    assert (*later, BAROMETER_DRIFT_ERROR, STATIC_PORT_ERROR, ERRORS) == (24, 27, 30, 33, 34, 35)
    assert (OUTDOORS.states, ARENA.states) == (ERRORS, ARENA_ERRORS) == (35, MAGNETIC_BIAS_ERROR)


def late(delay, jitter=0.0, rate=10.0):
    sensors = SHIPPED._replace(gnss=SHIPPED.gnss._replace(timing=Timing(rate, delay, jitter, 0.0)))
    return filter_settings(sensors, WIND, arena=False).horizon


def test_the_filter_stands_one_step_before_the_latest_reading_of_what_aids_it():
    assert late(0.2) == 21
    assert late(0.2 + 1e-6) == 22
    assert late(0.2, 0.01) == 24  # three deviations of its lateness
    assert late(0.0) >= round(kept.POSE_HORIZON / SLOW_STEP) + 1  # poses from outside may come at any time
    assert late(30.0) == kept.MAX_HORIZON - 1


def test_a_new_filter_has_seen_and_refused_nothing():
    made = new_filter(OUTDOORS, NOMINAL)
    assert (made.phase, made.filled, made.oldest, made.aligned_periods, made.moved, made.resets) == (
        kept.ALIGNING,
        *[0] * 5,
    )
    assert made.support == NOMINAL.g
    assert made.actuators == (0.0, 0.0, 0.0, 0.0)
    assert (made.fused_at == -1.0).all()
    assert (made.refused_since == -1.0).all()
    assert made.refused_at.max() < -1e6  # so long ago that nothing is mistrusted for it
    for part in (
        "covariance",
        "H",
        "errors",
        "leapt",
        "before",
        "fault_count",
        "failed",
        "repeated",
        "squares",
        "late",
    ):
        assert not getattr(made, part).any()
