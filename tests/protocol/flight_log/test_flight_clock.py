"""The vehicle's own time of records: late messages, restarts, and messages that tell no time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.flight_log.flight_clock import flight_clock, times_in_log
from protocol.tlog import TlogReader
from tests.support.logs import T0, bare, quadplane_log, record

VEHICLE = (1, 1)
BEAT = mavlink.MAVLink_heartbeat_message(20, 12, 0, 0, 4, 3)


def attitude(boot):
    """An ATTITUDE made at a time since boot [s]."""
    return mavlink.MAVLink_attitude_message(round(boot * 1000), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def recorded(*arrivals):
    """A log of (recorder's time [s], message)."""
    return TlogReader(b"".join(record(T0 + round(at * 1e6), bare(message)) for at, message in arrivals))


def arriving(sent):
    """A log of ATTITUDE, of pairs of time since boot and arrival [s], in the order of arrival."""
    return recorded(*((at, attitude(boot)) for boot, at in sorted(sent, key=lambda pair: pair[1])))


def boots(reader):
    return reader.columns("ATTITUDE")["time_boot_ms"] / 1e3


def since_first(reader):
    """Times since boot, less that of the first message in the log [s]."""
    return boots(reader) - boots(reader)[0]


def test_a_message_that_came_behind_its_successor_has_its_own_time_and_shifts_no_other():
    sent = [(k / 10, k / 10 + 0.15 * (k % 100 == 50)) for k in range(6000)]
    times = times_in_log(arriving(sent), VEHICLE)
    assert times[-1] == pytest.approx(599.9)
    assert np.sort(times) == pytest.approx(np.arange(6000) / 10)


def test_a_group_of_late_messages_shifts_no_later_time():
    sent = [(k / 10, k / 10 + (2.45 if 3000 <= k < 3030 else 0.0)) for k in range(6000)]
    reader = arriving(sent)
    assert times_in_log(reader, VEHICLE) == pytest.approx(since_first(reader))


@given(st.lists(st.floats(0.0, 4.0), min_size=40, max_size=120), st.integers(60, 1000), st.floats(0.2, 4.0))
@settings(max_examples=60, deadline=None)
def test_however_late_messages_come_each_has_its_own_time(delays, begin, speed):
    """In the first minute a late message may look like one of a vehicle that restarted."""
    sent = [(begin + k / 5, k / 5 / speed + delay) for k, delay in enumerate(delays)]
    reader = arriving(sent)
    assert times_in_log(reader, VEHICLE) == pytest.approx(since_first(reader), abs=1e-3)
    assert (np.diff(flight_clock(reader, VEHICLE).arrivals) >= 0.0).all()


@pytest.mark.parametrize("silence", [0.1, 12.0])
def test_a_restart_is_a_step_back_that_stays(silence):
    before = [(100.0 + k / 10, k / 10) for k in range(500)]
    begun = 49.9 + silence
    after = [(2.0 + k / 10, begun + k / 10) for k in range(3000)]
    times = times_in_log(arriving([*before, *after]), VEHICLE)
    assert times[499] == pytest.approx(49.9)
    assert np.diff(times[499:501]) == pytest.approx(silence, abs=1e-6)
    assert times[-1] == pytest.approx(49.9 + silence + 299.9)


def test_the_vehicles_own_clock_begins_anew_at_a_restart():
    before = [(100.0 + k / 10, k / 10) for k in range(500)]
    after = [(2.0 + k / 10, 60.0 + k / 10) for k in range(3000)]
    clock = flight_clock(arriving([*before, *after]), VEHICLE)
    assert [clock.since_boot(at) for at in (10.0, 61.0, 160.0)] == pytest.approx([110.0, 3.0, 102.0])
    assert clock.restarts == pytest.approx([58.0])  # in which its clock showed 0


def test_late_messages_after_a_restart_have_their_own_times_too():
    before = [(100.0 + k / 10, k / 10) for k in range(500)]
    after = [(2.0 + k / 10, 60.0 + k / 10 + 0.35 * (k % 50 == 20)) for k in range(3000)]
    reader = arriving([*before, *after])
    times, own = times_in_log(reader, VEHICLE), boots(reader)
    assert times[500:] - own[500:] == pytest.approx(49.9 + 10.1 - 2.0)


def test_a_message_without_a_time_stands_by_the_recorders_clock_between_those_around_it():
    reader = recorded((0.0, attitude(5.0)), (0.2, BEAT), (1.0, attitude(6.0)), (1.5, BEAT))
    assert times_in_log(reader, VEHICLE) == pytest.approx([0.0, 0.2, 1.0, 1.5])


def test_a_message_that_tells_no_true_time_has_its_neighbours():
    zero = mavlink.MAVLink_named_value_float_message(0, b"x", 1.0)
    since_1970 = mavlink.MAVLink_home_position_message(0, 0, 0, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0, T0)
    reader = recorded((0.0, attitude(500.0)), (0.5, zero), (0.5, since_1970), (1.0, attitude(501.0)))
    assert times_in_log(reader, VEHICLE) == pytest.approx([0.0, 0.5, 0.5, 1.0])


def test_a_time_in_microseconds_since_boot_is_a_messages_own():
    outputs = mavlink.MAVLink_actuator_output_status_message(500_300_000, 4, [0.0] * 32)
    reader = recorded((0.0, attitude(500.0)), (0.5, outputs), (1.0, attitude(501.0)))
    assert times_in_log(reader, VEHICLE)[1] == pytest.approx(0.3)


def test_how_much_faster_a_simulation_ran_is_told():
    reader = arriving([(5.0 + k / 10, k / 20) for k in range(200)])
    assert flight_clock(reader, VEHICLE).rate == pytest.approx(2.0)


def test_in_a_public_log_every_message_with_a_time_has_it():
    reader = TlogReader(quadplane_log())
    times = times_in_log(reader, VEHICLE)
    for name in ("ATTITUDE", "GLOBAL_POSITION_INT", "SYSTEM_TIME"):
        own = reader.columns(name, VEHICLE)["time_boot_ms"] / 1e3
        assert times[reader.rows(name, VEHICLE)] == pytest.approx(own - (own - times[reader.rows(name, VEHICLE)])[0])
