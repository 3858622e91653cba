"""The pacer's warnings of being late."""

import pytest

from sitl.process import vehicle_process
from sitl.process.vehicle_process import Pacer


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now = 100.0

        def monotonic(self):
            return self.now

    made = Clock()
    monkeypatch.setattr(vehicle_process, "time", made)
    return made


def test_a_punctual_vehicle_misses_nothing(clock):
    paced = Pacer(2.0, tick=0.02)
    for _ in range(5):
        clock.now += paced.wait_time(0.02)
    assert (paced.missed, paced.longest_delay) == (0, 0.0)


def test_ticks_flown_more_than_a_tick_late_are_missed(clock):
    paced = Pacer(2.0, tick=0.02)
    clock.now += 0.045  # the first of these is due after 10 ms at twice real time
    delays = [paced.wait_time(0.02) for _ in range(5)]
    assert delays[:4] == [0.0] * 4
    assert paced.missed == 3
    assert paced.longest_delay == pytest.approx(0.035)


def test_a_pause_that_is_not_caught_up_with_is_missed_whole(clock):
    paced = Pacer(1.0, tick=0.02)
    clock.now += 2.0
    paced.wait_time(0.02)
    assert paced.missed == 100
    clock.now += paced.wait_time(0.02)
    assert paced.missed == 100


def test_a_vehicle_as_fast_as_possible_is_never_late():
    paced = Pacer(0.0, tick=0.02)
    assert (paced.wait_time(1.0), paced.missed) == (0.0, 0)
