"""A replay is sent to another station while the operator wants it, and only the vehicle's own messages."""

import socket

import pytest

from darko_gcs.errors import LinkError
from darko_gcs.feed.links import OutwardAddress
from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.feed.replay_output import played_frames
from protocol.tlog import TlogReader, read_tlog
from tests.support.paths import DATA


@pytest.fixture
def other():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bound:
        bound.bind(("127.0.0.1", 0))
        bound.setblocking(False)
        yield bound


def replay(reader, other):
    return ReplayFeed(reader, "flight.tlog", send_to=OutwardAddress("udpout", "127.0.0.1", other.getsockname()[1]))


def received(other):
    frames = []
    while True:
        try:
            frames.append(other.recv(65536))
        except BlockingIOError:
            return frames


async def test_frames_of_the_vehicle_are_sent_as_they_are_played_and_only_then(other):
    reader = read_tlog(DATA / "square-flight.tlog")
    feed = replay(reader, other)
    await feed.open()
    feed.play(0.01)
    assert received(other) == []
    await feed.toggle_output()
    assert feed.snapshot.session.sends_to == f"127.0.0.1:{other.getsockname()[1]}"
    begin = feed.timeline.played
    feed.play(0.04)
    sent = [row for row in played_frames(reader).rows.tolist() if begin <= row < feed.timeline.played]
    assert received(other) == [reader.frame(row) for row in sent]
    assert 0 < len(sent) < feed.timeline.played - begin  # the ground station's are left out
    feed.seek(2.0)
    assert received(other) == []
    assert feed.snapshot.session.sends_to
    await feed.toggle_output()
    feed.play(0.04)
    assert received(other) == []
    assert feed.snapshot.session.sends_to == ""


async def test_a_log_with_nothing_to_send_and_an_address_that_is_none_are_told(other):
    with pytest.raises(LinkError, match="nothing to send: 0 frames"):
        await replay(TlogReader(b""), other).toggle_output()
    feed = ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "x", send_to=OutwardAddress("udpout", "no such host", 9))
    with pytest.raises(LinkError, match="cannot send to udpout:no such host:9"):
        await feed.toggle_output()
    assert feed.snapshot.session.sends_to == ""
