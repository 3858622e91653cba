"""The recorder's clock: what is a silence, and what is a clock that was set."""

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.tlog import TlogReader
from protocol.tlog.reader import Timeline, recorder_clock
from tests.support.logs import T0, bare, flight, record

HOUR, DAY = 3_600_000_000, 86_400_000_000  # [us]


def clock_of(times):
    return recorder_clock(np.array(times, dtype=np.int64))


def flown(stamps, boots):
    """A log of ATTITUDE, by recorder's times [us] and times since boot [s]."""
    messages = [mavlink.MAVLink_attitude_message(round(b * 1000), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0) for b in boots]
    return TlogReader(b"".join(record(t, bare(m)) for t, m in zip(stamps, messages, strict=True)))


def test_a_first_stamp_of_1970_is_a_clock_that_was_set_before_the_second():
    clock = clock_of([0, *(T0 + 100_000 * k for k in range(1, 100))])
    assert clock.duration == pytest.approx(9.8)
    assert clock.forward.tolist() == [1]
    assert clock.steps(clock.forward)[0] == pytest.approx(T0 / 1e6 + 0.1)
    assert clock.start_usec == T0 + 100_000  # by the clock that most records were made by


def test_a_last_stamp_too_late_by_days_has_no_playing_time():
    clock = clock_of([*(T0 + 100_000 * k for k in range(100)), T0 + 3 * DAY])
    assert clock.duration == pytest.approx(9.9)
    assert (clock.forward.tolist(), clock.start_usec) == ([100], T0)


def test_a_silence_of_hours_is_one_where_nothing_tells_another_time():
    clock = clock_of([T0, T0 + 1_000_000, T0 + 5 * HOUR])
    assert (clock.duration, len(clock.forward)) == (5 * 3600.0, 0)
    assert len(clock_of([T0, T0 + DAY]).forward) == 0
    assert len(clock_of([T0, T0 + DAY + 1]).forward) == 1


@pytest.mark.parametrize(("boot", "is_set"), [(11.2, True), (11.0 + 3 * 3600, False), (3.0, False)])
def test_the_vehicles_clock_tells_a_clock_that_was_set_by_hours(boot, is_set):
    """After the leap it shows 0.2 s more, as much more as the recorder's, or that it restarted."""
    stamps = [T0, T0 + 1_000_000, T0 + 3 * HOUR]
    reader = flown(stamps, [10.0, 11.0, boot])
    assert reader.clock.forward.tolist() == ([2] if is_set else [])
    assert reader.clock.duration == pytest.approx(1.0 if is_set else 3 * 3600.0)


def test_a_log_begins_when_most_of_its_records_say():
    early = [1000 * k for k in range(5)]  # a recorder that starts without a clock
    late = [T0 + 1000 * k for k in range(50)]
    assert clock_of([*early, *late]).start_usec == T0 - 4000
    assert clock_of([*late, *early]).start_usec == T0
    assert clock_of([]).start_usec == 0


def test_steps_of_the_clock_are_marked_on_the_timeline():
    frames = flight(3)
    stamps = (0, T0, T0 + 1_000_000)
    line = Timeline(TlogReader(b"".join(record(t, f) for t, f in zip(stamps, frames, strict=True))))
    assert [marker.what for marker in line.markers] == [f"recording clock stepped by {T0 / 1e6:.3f} s"]
    assert line.duration == pytest.approx(1.0)
