"""The remote end: its frames in order, beyond the wrap of their one-byte numbers."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.base import INITIAL_TIMEOUT, MAX_TIMEOUT, MIN_TIMEOUT, Remote, RttEstimator
from protocol.wire.codec import Codec


def frame(number):
    """A frame with this sequence number."""
    vehicle = Codec(1, 1)
    vehicle.sequence = number & 0xFF
    (message,) = Codec(255, 190).decode(vehicle.encode(mavlink.MAVLink_heartbeat_message(19, 12, 0, 0, 4, 3)))
    return message


@pytest.mark.parametrize("newest", [0, 100, 200, 255])
@pytest.mark.parametrize(("ahead", "counted"), [(1, 1), (127, 127), (128, -128), (255, -1), (0, 0)])
def test_a_frame_from_half_the_range_on_is_an_earlier_one(newest, ahead, counted):
    remote = Remote()
    remote.hear(frame(newest), 0.0)
    assert remote.number(frame(newest + ahead)) == newest + counted
    remote.hear(frame(newest + ahead), 1.0)
    assert remote.newest == newest + max(counted, 0)


def test_nothing_was_heard_at_first():
    remote = Remote()
    assert (remote.newest, remote.heard) == (None, -math.inf)
    assert remote.number(frame(200)) == 200
    remote.hear(frame(200), 3.5)
    assert (remote.newest, remote.heard) == (200, 3.5)


def test_a_mark_remembers_for_two_seconds_what_was_sent_before_it():
    remote = Remote()
    remote.hear(frame(250), 10.0)
    mark = remote.mark(10.0)
    remote.hear(frame(3), 10.5)
    assert [remote.was_sent_before(mark, frame(number), 11.99) for number in (249, 250, 251, 3)] == [
        True, True, False, False,
    ]  # fmt: skip
    assert not remote.was_sent_before(mark, frame(249), 12.0)


def test_the_estimate_follows_rfc_6298():
    rtt = RttEstimator()
    assert rtt.timeout == INITIAL_TIMEOUT == 1.0
    rtt.measure(0.4)
    assert rtt.timeout == pytest.approx(0.4 + 4 * 0.2)
    rtt.measure(0.6)
    deviation, mean = 0.2 + (0.2 - 0.2) / 4, 0.4 + 0.2 / 8
    assert rtt.timeout == pytest.approx(mean + 4 * deviation)
    rtt.measure(0.1)
    deviation, mean = deviation + (0.325 - deviation) / 4, mean - 0.325 / 8
    assert rtt.timeout == pytest.approx(mean + 4 * deviation)


def test_the_timeout_has_its_bounds():
    rtt = RttEstimator(0.6)
    rtt.miss()
    assert rtt.timeout == 1.2
    rtt.miss()
    assert rtt.timeout == MAX_TIMEOUT == 1.5
    for _ in range(40):
        rtt.measure(0.001)
    assert rtt.timeout == MIN_TIMEOUT == 0.25
