"""Doubt of gyroscope and accelerometer: which of them has led the belief astray, and what that changes."""

import numpy as np
import pytest

from sitl.estimation import doubts
from sitl.estimation.filter import SLOW_STEP
from sitl.estimation.fusion import SATELLITE_VELOCITY
from sitl.estimation.nominal_state import ATTITUDE_ERROR, ERRORS, GYRO_BIAS_ERROR, MAGNETIC_BIAS_ERROR
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import ACCELEROMETER, BAROMETER, FIRST_DELAYED, GNSS, GYROSCOPE, MAGNETOMETER
from tests.sitl.estimation.test_arrivals import BEGIN, EVERY, flown, heard

FIELD_LINE, SATELLITE_LINE = MAGNETOMETER - FIRST_DELAYED, GNSS - FIRST_DELAYED
LONG_AGO = BEGIN - 1000.0


def far_field(i, f, period):
    earth = i["specification"]["magnetometer"]
    noise = 1e-10 * (period // EVERY % 7)  # or it is stuck
    heard(i, f, MAGNETOMETER, period, noise - earth["field_north"], earth["field_west"], earth["field_up"])


def astray(*, field, speed):
    """A filter that satellites contradict for a while, in the field's company or not."""
    i, f = flown()
    f["fused_at"][:] = LONG_AGO
    for k in range(MAGNETIC_BIAS_ERROR, MAGNETIC_BIAS_ERROR + 3):
        f["covariance"][k, k] = 1e-13  # T2
    for k in range(13):
        period = BEGIN + EVERY * k
        if field:
            far_field(i, f, period)
        heard(i, f, GNSS, period, 40.0 + (0.1 * speed + 0.01) * k, 0.0, 0.0, speed, 0.0, 0.0)
        if f["resets"]:
            return f, round((period - BEGIN) * PERIOD, 1)
    raise AssertionError("nothing was noticed")


def test_field_and_satellites_that_both_contradict_the_belief_are_right_at_once():
    f, after = astray(field=True, speed=3.0)
    assert after == pytest.approx(doubts.BOTH_TIME, abs=0.11)
    assert f["doubted_until"].tolist() == [pytest.approx(BEGIN + (after + doubts.DOUBTED_TIME) / PERIOD), -1.0]
    assert (f["refused_since"][[FIELD_LINE, SATELLITE_LINE]] < 0.0).all()
    doubt = np.sqrt(np.diag(f["covariance"]))
    assert doubt[ATTITUDE_ERROR : ATTITUDE_ERROR + 3] == pytest.approx(doubts.DOUBTED_TURN)
    assert doubt[GYRO_BIAS_ERROR : GYRO_BIAS_ERROR + 3] == pytest.approx(doubts.DOUBTED_RATE)


@pytest.mark.parametrize("slot", [FIELD_LINE, SATELLITE_LINE, SATELLITE_VELOCITY])
def test_one_that_leapt_is_no_witness(slot):
    _, f = flown()
    f["refused_since"][[FIELD_LINE, SATELLITE_LINE]] = BEGIN
    now = BEGIN + doubts.BOTH_TIME / PERIOD
    assert doubts.both_refused(f, now)
    assert not doubts.both_refused(f, now - 1)
    f["leapt"][slot] = 1.0
    assert not doubts.both_refused(f, now)


@pytest.mark.parametrize("alone", [FIELD_LINE, SATELLITE_LINE, BAROMETER - FIRST_DELAYED])
def test_one_alone_is_no_two(alone):
    _, f = flown()
    f["refused_since"][alone] = BEGIN
    assert not doubts.both_refused(f, BEGIN + 500)


def test_where_the_field_agrees_and_the_speed_does_not_the_accelerometer_is_doubted():
    f, after = astray(field=False, speed=3.0)
    assert f["doubted_until"][GYROSCOPE] < 0.0
    assert f["doubted_until"][ACCELEROMETER] == pytest.approx(BEGIN + (after + doubts.DOUBTED_TIME) / PERIOD)
    assert np.diag(f["covariance"])[ATTITUDE_ERROR] < 0.5 * doubts.DOUBTED_TURN**2


def test_a_place_alone_that_is_elsewhere_casts_no_doubt_on_either():
    f, _ = astray(field=False, speed=0.0)
    assert (f["doubted_until"] < 0.0).all()
    assert np.diag(f["covariance"])[ATTITUDE_ERROR] < 0.5 * doubts.DOUBTED_TURN**2


def test_a_field_that_contradicts_the_attitude_acquits_the_accelerometer():
    i, f = flown()
    for k in range(MAGNETIC_BIAS_ERROR, MAGNETIC_BIAS_ERROR + 3):
        f["covariance"][k, k] = 1e-13  # T2
    f["fused_at"][:] = LONG_AGO
    f["doubted_until"][ACCELEROMETER] = BEGIN + 10000.0
    resets = []
    for k in range(12):
        far_field(i, f, BEGIN + EVERY * k)
        resets.append(int(f["resets"]))
    assert resets == [0] * 10 + [1] * 2
    assert f["doubted_until"][ACCELEROMETER] < 0.0 < f["doubted_until"][GYROSCOPE]


def test_a_field_alone_acquits_nobody_where_nobody_is_doubted():
    _, f = flown()
    f["refused_since"][FIELD_LINE] = BEGIN
    assert not doubts.wrongly_doubted(f, BEGIN + 1000)


@pytest.mark.parametrize(("period", "more"), [(99, 1.0), (100, 0.0)])
def test_what_a_doubted_gyroscope_tells_becomes_less_sure(period, more):
    _, f = flown()
    f["doubted_until"][GYROSCOPE] = 100.0
    before = np.diag(f["covariance"]).copy()
    doubts.loosen_doubted(f, period)
    gained = np.zeros(ERRORS)
    gained[ATTITUDE_ERROR : ATTITUDE_ERROR + 3] = more * doubts.LOOSE_TURN**2 * SLOW_STEP
    gained[GYRO_BIAS_ERROR : GYRO_BIAS_ERROR + 3] = more * doubts.LOOSE_RATE**2 * SLOW_STEP
    assert np.diag(f["covariance"]) - before == pytest.approx(gained)
