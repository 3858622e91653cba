"""Readings as they arrive: which are fused, which are those of a stuck instrument, and when the belief is wrong."""

import numpy as np
import pytest

from sitl.estimation.arrivals import REFUSED_TIME, fuse_arrived
from sitl.estimation.filter import Step, put_nominal
from sitl.estimation.nominal_state import ATTITUDE_ERROR, ERRORS, GNSS_DRIFT_ERROR
from sitl.estimation.strapdown import no_increment
from sitl.model.quaternions import from_euler
from sitl.model.state import Actuators
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD, SLOW_PERIODS
from sitl.sensors.instruments import (
    BAROMETER,
    EXTERNAL_POSE,
    FIRST_DELAYED,
    GNSS,
    MAGNETOMETER,
    MOTION_CAPTURE,
    N_DELAYED,
    PITOT,
    READING_SIZE,
    send,
)
from sitl.storage import value_of
from tests.support.flights.ideal_sensors import SHIPPED, ZERO, aboard

STEP = Step(no_increment(), ZERO, ZERO, ZERO, ZERO, Actuators(0.0, 0.0, 0.0, 0.0))
BEGIN = 5000  # control periods flown
EVERY = 50  # of them between two readings: a tenth of a second


def flown(*, arena=False):
    """Instruments and a filter that is as sure of everything as it can be in flight."""
    i, f, _ = aboard(SHIPPED, arena=arena)
    f["covariance"][:] = 1e-2 * np.eye(ERRORS)
    f["covariance"][GNSS_DRIFT_ERROR:, GNSS_DRIFT_ERROR:] *= 1e-2
    return i, f


def heard(i, f, instrument, period, *values):
    """A reading that arrives as soon as it is read."""
    line = instrument - FIRST_DELAYED
    i["last"][line] = [*values, *[0.0] * (READING_SIZE - len(values))]
    send(line, i, period, period)
    fuse_arrived(f, i, period, period, STEP)


@pytest.mark.parametrize(("arena", "used"), [(False, {*range(FIRST_DELAYED, FIRST_DELAYED + N_DELAYED)}),
                                             (True, {PITOT, MOTION_CAPTURE, EXTERNAL_POSE})])  # fmt: skip
def test_under_motion_capture_nothing_is_taken_of_what_aids_outdoors(arena, used):
    i, f = flown(arena=arena)
    for instrument in (MAGNETOMETER, BAROMETER, GNSS, PITOT, MOTION_CAPTURE, EXTERNAL_POSE):
        heard(i, f, instrument, BEGIN, *[10.0] * READING_SIZE)
    assert {line + FIRST_DELAYED for line in range(N_DELAYED) if f["scalars"][line]} == used
    assert not i["waiting"].any()


@pytest.mark.parametrize(("instrument", "fused"), [(GNSS, 4), (BAROMETER, 4), (EXTERNAL_POSE, 7)])
def test_what_repeats_itself_to_the_bit_four_times_is_stuck_unless_it_comes_from_outside(instrument, fused):
    i, f = flown()
    line, counts = instrument - FIRST_DELAYED, []
    for k in range(7):
        before = f["scalars"][line]
        heard(i, f, instrument, BEGIN + EVERY * k, 0.01)
        counts.append(f["scalars"][line] > before)
    assert counts == [True] * fused + [False] * (7 - fused)
    heard(i, f, instrument, BEGIN + EVERY * 7, 0.02)
    before = f["scalars"][line]
    heard(i, f, instrument, BEGIN + EVERY * 8, 0.02)
    assert f["scalars"][line] > before  # it has moved in between


def far_away(*, leaps=0.0, just_before=False):
    """Resets of the filter to a receiver that tells a far place for a while, and the position it believes in."""
    i, f = flown()
    line = GNSS - FIRST_DELAYED
    if just_before:
        f["fused_at"][line] = BEGIN - EVERY
    for k in range(round((REFUSED_TIME + 0.3) / PERIOD / EVERY)):
        heard(i, f, GNSS, BEGIN + EVERY * k, 100.0 + 0.01 * k + leaps * (k % 2), 20.0, 40.0, 1.0, -2.0, 3.0)
    return f["resets"], value_of(f.nominal)


def test_readings_that_agree_among_themselves_and_are_refused_for_a_second_are_right():
    resets, belief = far_away()
    assert resets == 1
    assert belief.position == pytest.approx((100.1, 20.0, 40.0), abs=0.3)
    assert belief.velocity == pytest.approx((1.0, -2.0, 3.0), abs=0.1)


def test_they_are_not_taken_before_that_second_is_over():
    i, f = flown()
    resets = []
    for k in range(13):
        heard(i, f, GNSS, BEGIN + EVERY * k, 100.0 + 0.01 * k, 20.0, 40.0, 1.0, -2.0, 3.0)
        resets.append(int(f["resets"]))
    assert resets == [0] * 11 + [1] * 2  # ten a second, and the first is refused too


def test_a_pose_that_was_right_all_along_sets_the_attitude_and_leaves_little_doubt_of_it():
    i, f = flown(arena=True)
    turned = from_euler(0.5, -1.0, 0.3)
    for k in range(13):
        heard(i, f, MOTION_CAPTURE, BEGIN + EVERY * k, 20.0 + 0.01 * k, 1.0, 2.0, *turned, 1e-6, 1e-6, 1.0)
    assert f["resets"] == 1
    assert abs(np.dot(value_of(f.nominal).attitude, turned)) == pytest.approx(1.0, abs=1e-3)
    doubt = np.sqrt(np.diag(f["covariance"])[ATTITUDE_ERROR : ATTITUDE_ERROR + 3])
    assert (doubt < 0.1).all()  # rad


def test_a_late_reading_is_compared_with_where_the_vehicle_was():
    i, f = flown()
    put_nominal(f, value_of(f.nominal)._replace(velocity=Vector(5.0, 0.0, 0.0)))
    line, ago = GNSS - FIRST_DELAYED, SLOW_PERIODS - 1
    i["last"][line] = [0.1 - 5.0 * ago * PERIOD, 0.0, 0.0, 5.0, 0.0, 0.0, *[0.0] * (READING_SIZE - 6)]
    send(line, i, BEGIN - ago, BEGIN)
    fuse_arrived(f, i, BEGIN, BEGIN, STEP)
    assert 0.0 < value_of(f.nominal).position.x < 0.1  # a part of the decimetre that the receiver says more


def test_readings_that_leap_or_begin_with_a_leap_of_what_was_right_just_before_are_not():
    assert far_away(leaps=5.1)[0] == 0
    assert far_away(just_before=True)[0] == 0
    assert far_away(leaps=4.9)[0] == 1


def test_what_comes_after_its_time_is_counted_and_not_used():
    i, f = flown()
    line = GNSS - FIRST_DELAYED
    i["last"][line] = np.full(READING_SIZE, 0.5)
    send(line, i, BEGIN - 100, BEGIN)
    fuse_arrived(f, i, BEGIN, BEGIN, STEP)
    assert (f["late"][line], f["scalars"][line]) == (1.0, 0.0)
    send(line, i, BEGIN + 1, BEGIN + 1)
    fuse_arrived(f, i, BEGIN, BEGIN, STEP)  # it is read after the instant at which the filter stands
    assert (f["late"][line], i["waiting"][line]) == (1.0, 1.0)
    assert value_of(f.nominal).position == Vector(0.0, 0.0, 0.0)
