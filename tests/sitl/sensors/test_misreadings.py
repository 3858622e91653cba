"""Readings of instruments that fail by an offset, a share, ever more, or late."""

import numpy as np
import pytest

from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import (
    ACCELEROMETER,
    BAROMETER,
    DELAYED,
    DRIFTING,
    GYROSCOPE,
    HEALTHY,
    SCALED,
    WRONG,
    Inertial,
)
from sitl.sensors.misreadings import (
    DRIFT_FORCE,
    DRIFT_RATE,
    INERTIAL_DELAY,
    RATE_SCALE_ERROR,
    SCALE_ERROR,
    WRONG_FORCE,
    WRONG_RATE,
    Misreading,
    error_of,
    misread,
    misreading,
)
from tests.support.flights.ideal_sensors import aboard

READ = Inertial(Vector(1.0, 2.0, 3.0), Vector(10.0, -2.0, 4.0))
LEANING = np.array([1.0, 1.0, -1.0])


def instruments(failure, *, size=1.0, since=0):
    i, _, _ = aboard()
    for instrument in (GYROSCOPE, ACCELEROMETER, BAROMETER):
        i["failures"][instrument], i["sizes"][instrument], i["failed_at"][instrument] = failure, size, since
    return i


def test_a_healthy_reading_is_handed_on_to_the_bit():
    assert misread(instruments(HEALTHY), READ, 7, PERIOD) == READ


@pytest.mark.parametrize("size", [1.0, -0.5])
def test_a_wrong_one_is_off_by_its_size(size):
    wrong = misread(instruments(WRONG, size=size), READ, 7, PERIOD)
    assert np.subtract(wrong.rates, READ.rates) == pytest.approx(size * WRONG_RATE * LEANING)
    assert np.subtract(wrong.force, READ.force) == pytest.approx(size * WRONG_FORCE * LEANING)


def test_a_scaled_one_reads_a_share_too_much():
    wrong = misread(instruments(SCALED, size=0.5), READ, 7, PERIOD)
    assert np.array(wrong.rates) == pytest.approx((1.0 + 0.5 * RATE_SCALE_ERROR) * np.array(READ.rates))
    assert np.array(wrong.force) == pytest.approx((1.0 + 0.5 * SCALE_ERROR) * np.array(READ.force))


def test_a_drifting_one_is_right_when_it_begins_and_off_ever_more():
    i = instruments(DRIFTING, since=1000)
    assert misread(i, READ, 1000, PERIOD) == READ
    later = misread(i, READ, 2000, PERIOD)
    assert np.subtract(later.rates, READ.rates) == pytest.approx(2.0 * DRIFT_RATE * LEANING)
    assert np.subtract(later.force, READ.force) == pytest.approx(2.0 * DRIFT_FORCE * LEANING)


def test_a_delayed_one_tells_what_was_read_a_while_ago():
    i, late = instruments(DELAYED), round(INERTIAL_DELAY / PERIOD)
    told = [
        misread(i, Inertial(Vector(float(n), 0.0, 0.0), Vector(0.0, float(n), 0.0)), n, PERIOD) for n in range(1, 300)
    ]
    for n in range(late + 1, 300):
        assert (told[n - 1].rates.x, told[n - 1].force.y) == (n - late, n - late)


def test_other_instruments_take_their_error_by_their_own_units():
    assert misreading(instruments(WRONG, size=2.0), BAROMETER, 5, PERIOD) == Misreading(1.0, 2.0, 0.0)
    drifted = misreading(instruments(DRIFTING, size=2.0, since=500), BAROMETER, 1000, PERIOD)
    assert error_of(drifted, 5.0, 0.5) == pytest.approx(2.0 * 0.5)
    assert error_of(misreading(instruments(WRONG), BAROMETER, 5, PERIOD), 5.0, 0.5) == 5.0
