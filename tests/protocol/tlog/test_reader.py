"""Reads a telemetry log: an index of every record, messages one by one, fields as arrays, a timeline to play."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.tlog import TlogReader
from protocol.tlog.reader import Timeline, recorder_clock
from tests.support.logs import T0, bare, flight, log_of, record, unknown_frame

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


def timeline(frames, **others):
    return Timeline(TlogReader(log_of(frames, **others)))


def buffers(messages):
    return [bytes(message.get_msgbuf()) for message in messages]


def advanced(line, dt):
    """The frames of the next ``dt`` seconds [s]."""
    return buffers(message for row in line.advance(dt) if (message := line.message(row)) is not None)


@given(steps=st.lists(st.floats(0, 0.05), max_size=30))
@settings(max_examples=60, deadline=None)
def test_playing_in_any_steps_plays_every_message_once_and_in_order(steps):
    frames = flight(25)
    line = timeline(frames)
    played = [frame for dt in steps for frame in advanced(line, dt)]
    assert line.position <= line.duration
    played += advanced(line, line.duration)
    assert played == frames
    assert line.finished
    assert advanced(line, 1.0) == []


def test_a_step_plays_the_messages_after_the_position_up_to_its_end():
    frames = flight(5)  # at 0, 10, 20, 30, 40 ms
    line = timeline(frames)
    assert line.duration == pytest.approx(0.04)
    assert advanced(line, 0.0) == frames[:1]
    assert advanced(line, 0.02) == frames[1:3]
    assert line.position == pytest.approx(0.02)
    assert line.time_usec == T0 + 20_000
    assert advanced(line, 5.0) == frames[3:]


def test_after_a_seek_playing_continues_there():
    frames = flight(5)
    line = timeline(frames)
    line.advance(1.0)
    line.seek(0.02)
    assert line.played == 3
    assert advanced(line, 0.01) == frames[3:4]
    line.seek(-3.0)
    assert line.position == 0.0
    line.seek(99.0)
    assert line.finished


def test_after_so_many_records_the_position_is_that_of_the_last_of_them():
    line = timeline(flight(5))  # at 0, 10, 20, 30, 40 ms
    for played, position in ((1, 0.0), (3, 0.02), (5, 0.04)):
        line.go_to(played)
        assert line.position == pytest.approx(position)


def test_records_of_one_time_are_told_apart_by_their_number():
    line = timeline(flight(4), step=0)
    line.go_to(2)
    assert (line.position, line.played) == (0.0, 2)
    assert list(line.advance(1.0)) == [2, 3]
    line.go_to(-5)
    assert line.played == 1
    line.go_to(99)
    assert line.finished


def test_messages_outside_the_dialect_are_left_out():
    frames = flight(3)
    line = timeline([frames[0], unknown_frame(77_000, b"ab"), *frames[1:]])
    assert advanced(line, 1.0) == frames


def test_an_empty_log_is_a_timeline_without_length():
    line = Timeline(TlogReader(b""))
    line.seek(3.0)
    line.go_to(3)
    assert (line.duration, list(line.advance(1.0)), line.markers) == (0.0, [], ())
    assert line.finished
    assert line.time_usec == 0


def test_damage_and_clock_steps_are_marked_where_they_happened():
    frames = flight(3)
    times = [T0, T0 + 1_000_000, T0 - 5_000_000]
    records = [record(time, frame) for time, frame in zip(times, frames, strict=True)]
    line = Timeline(TlogReader(b"junk" + records[0] + records[1] + b"\x01" * 30 + records[2]))
    assert [(marker.time, marker.what) for marker in line.markers] == [
        (0.0, "4 bytes damaged: no frame where one should start"),
        (1.0, "30 bytes damaged: no frame where one should start"),
        (1.0, "recording clock stepped by -6.000 s"),
    ]


@pytest.mark.parametrize(
    ("recorded", "played"),
    [
        ([], []),
        ([7], [0.0]),
        ([10, 20, 40], [0, 10, 30]),
        ([10, 20, 5, 15], [0, 10, 10, 20]),  # clock set back: playing continues
        ([10, 20, 9_000_000, 30, 40], [0, 10, 10, 20, 30]),  # one time far ahead
        ([10, 20, 3, 30, 40], [0, 10, 10, 20, 30]),  # one time far behind
        ([9_000_000, 20, 30], [0, 0, 10]),
        ([20, 10, 30], [0, 0, 10]),
        ([9_000_000, 3, 9_000_020, 9_000_030], [0, 0, 20, 30]),  # the second one far behind: no pause
    ],
)
def test_playing_time_never_runs_backwards(recorded, played):
    assert (recorder_clock(np.array(recorded, dtype=np.int64)).playing * 1e6).tolist() == pytest.approx(played)


@given(recorded=st.lists(st.integers(0, 2**53 - 1), max_size=30))
@settings(max_examples=100, deadline=None)
def test_playing_times_ascend_from_zero(recorded):
    times = recorder_clock(np.array(recorded, dtype=np.int64)).playing
    assert len(times) == len(recorded)
    assert not len(times) or times[0] == 0.0
    assert np.all(np.diff(times) >= 0.0)
