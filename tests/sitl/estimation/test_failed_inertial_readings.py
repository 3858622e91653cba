"""An instrument that repeats itself or leaps has failed, and is believed again once it reads as ever."""

import itertools

import pytest

from sitl.estimation.navigator import FORCE_LEAP, fault_count_after, has_failed
from sitl.model.vectors import Vector

STILL, LEAPT = Vector(1.0, 2.0, 3.0), Vector(1.0, 2.0, 3.0 + 1.01 * FORCE_LEAP)


def judged(readings):
    """Whether the instrument has failed, after each reading but the first."""
    count = failed = 0.0
    verdicts = []
    for before, now in itertools.pairwise(readings):
        count = fault_count_after(count, now, before, FORCE_LEAP)
        failed = has_failed(count, failed)
        verdicts.append(failed == 1.0)
    return verdicts


@pytest.mark.parametrize("odd", [[STILL] * 41, [STILL, LEAPT] * 20 + [STILL]])
def test_fifteen_odd_readings_are_those_of_a_failed_instrument(odd):
    assert judged(odd) == [False] * 14 + [True] * 26


def test_a_leap_every_third_reading_is_a_failure_and_every_twentieth_is_not():
    noise = [Vector(0.1 * (k % 7), 0.0, 0.0) for k in range(600)]
    for every, fails in ((3, True), (20, False)):
        readings = [LEAPT if k % every == 0 else value for k, value in enumerate(noise)]
        assert judged(readings)[-1] is fails


def test_it_is_believed_again_when_nothing_odd_is_left():
    noise = [Vector(0.1 * (k % 7), 0.0, 0.0) for k in range(400)]
    verdicts = judged([STILL] * 101 + noise)
    assert verdicts[100]
    assert not verdicts[-1]
    assert verdicts.index(False, 50) > 300  # a second or two of flight at 500 Hz, not a single good reading
