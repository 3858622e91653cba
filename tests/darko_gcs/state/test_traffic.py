"""Rates, ages and losses of every message, on a link and in a recording of it."""

import math

import pytest

from darko_gcs.feed.recorded_traffic import RecordedTraffic
from darko_gcs.state import traffic as traffic_module
from darko_gcs.state.traffic import LiveTraffic, MessageKind, mean_rate
from protocol.tlog import TlogReader
from protocol.tlog.reader import Timeline
from protocol.wire.codec import Codec
from tests.support.gcs.messages import heartbeat, position
from tests.support.logs import bare, log_of

POSITION, BEAT = MessageKind((1, 1), "LOCAL_POSITION_NED"), MessageKind((1, 1), "HEARTBEAT")
SECOND = 1_000_000  # [us]


def frames(count=60):
    """A position each 0.1 s and every tenth time a heartbeat before it; two frames are lost, one comes late."""
    sent = []
    for k in range(count):
        if k % 10 == 0:
            sent.append((k * 0.1, heartbeat()))
        sent.append((k * 0.1, position(100 * k, k)))
    numbered = [(time, bare(message, sequence=k % 256)) for k, (time, message) in enumerate(sent)]
    late = numbered.pop(20)
    numbered.insert(22, (numbered[22][0], late[1]))
    return [each for k, each in enumerate(numbered) if k not in {40, 41}]


@pytest.fixture
def live():
    codec = Codec(255, 190)
    traffic = LiveTraffic(codec)
    for time, frame in frames():
        traffic.take(codec.decode(frame), time)
    return traffic


def recorded():
    reader = TlogReader(b"".join(log_of([frame], start=SECOND + round(time * SECOND)) for time, frame in frames()))
    timeline = Timeline(reader)
    return RecordedTraffic(reader, timeline), timeline


def by_kind(traffic, now):
    return {heard.kind: heard for heard in traffic.heard(now)}


def test_each_message_has_its_rates_age_size_and_count(live):
    heard = by_kind(live, 6.0)[POSITION]
    assert heard.rate == pytest.approx(10.0, abs=0.5)
    assert heard.mean == pytest.approx(10.0, abs=0.5)
    assert heard.age == pytest.approx(0.1)
    assert (heard.size, heard.total) == (len(bare(position(5900, 59))), 58)
    assert "vx" in heard.fields


def test_a_message_that_stops_has_no_rate_but_keeps_its_mean(live):
    heard = by_kind(live, 100.0)[POSITION]
    assert heard.rate == 0.0
    assert heard.mean == pytest.approx(10.0, abs=0.5)
    assert heard.age == pytest.approx(94.1)


def test_a_single_message_has_no_mean_rate():
    codec = Codec(255, 190)
    traffic = LiveTraffic(codec)
    traffic.take(codec.decode(bare(heartbeat())), 1.0)
    assert math.isnan(by_kind(traffic, 1.5)[BEAT].mean)


def test_frames_that_never_came_are_lost_and_a_late_one_is_not(live):
    assert live.losses()[1, 1].lost == 2


def test_the_last_message_of_a_kind_is_kept(live):
    assert live.last(POSITION).time_boot_ms == 5900
    assert live.last(MessageKind((1, 1), "ATTITUDE")) is None


def test_a_flood_of_invented_senders_takes_no_memory(monkeypatch):
    monkeypatch.setattr(traffic_module, "MAX_KINDS", 3)
    traffic = LiveTraffic(Codec(255, 190))
    for system in range(1, 9):
        traffic.take(Codec(255, 190).decode(bare(heartbeat(), system=system)), 0.0)
    assert len(traffic.heard(0.0)) == 3


def test_a_rate_beyond_the_kept_arrivals_is_that_of_the_newest():
    traffic, message = LiveTraffic(Codec(255, 190)), Codec(255, 190).decode(bare(heartbeat()))
    for k in range(4000):
        traffic.take(message, k * 0.001)
    assert by_kind(traffic, 4.0)[BEAT].rate == pytest.approx(1000.0, rel=0.03)


def test_a_recording_played_to_its_end_tells_the_same(live):
    traffic, timeline = recorded()
    timeline.seek(1e3)
    now = timeline.position
    there, here = by_kind(traffic, now), by_kind(live, now)
    assert there.keys() == here.keys()
    for kind, heard in here.items():
        found = there[kind]
        assert (found.total, found.size, found.fields) == (heard.total, heard.size, heard.fields)
        assert (found.rate, found.mean, found.age) == pytest.approx((heard.rate, heard.mean, heard.age), abs=1e-5)
    assert traffic.losses()[1, 1].lost == live.losses()[1, 1].lost
    assert traffic.last(POSITION).time_boot_ms == 5900
    assert traffic.unread == 0


def test_a_recording_tells_only_what_was_played():
    traffic, timeline = recorded()
    timeline.seek(1.05)
    assert by_kind(traffic, timeline.position)[POSITION].total == 11
    assert traffic.last(POSITION).time_boot_ms == 1000
    timeline.seek(0.0)
    assert traffic.losses()[1, 1].received == 2


def test_a_burst_has_no_mean_rate():
    assert math.isnan(mean_rate(11, 0.004))
    assert mean_rate(11, 2.0) == 5.0
