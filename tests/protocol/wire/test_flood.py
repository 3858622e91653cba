"""Damaged and hostile datagrams cost the codec little and reach nobody."""

import pytest

from protocol.dialect import mavlink
from protocol.wire.codec import MAX_COUNTED_SOURCES, MAX_FALSE_STARTS, MAX_KNOWN_STREAMS, Codec, SourceStatistics
from protocol.wire.message_frames import read_frame
from tests.support.links.flood import Flood, framed, orders
from tests.support.logs import bare

ALIVE = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def test_a_datagram_of_false_frame_starts_is_dropped_early():
    """Each byte may begin a frame: a long datagram of them must not delay the vehicle."""
    codec = Codec(1, 1)
    assert codec.decode(b"\xfe" * 65_507) == []
    assert codec.statistics.garbage_bytes == 65_507
    assert codec.statistics.bad_crc <= MAX_FALSE_STARTS


def test_a_frame_behind_a_little_garbage_is_still_found():
    frame = bare(ALIVE)
    for count in (1, 10, MAX_FALSE_STARTS - 1):
        assert len(Codec(1, 1).decode(b"\xfe" * count + frame)) == 1


def test_counted_sources_are_limited_and_the_busiest_stay():
    codec = Codec(1, 1)
    for number in range(20):
        codec.decode(bare(ALIVE, system=1, component=1, sequence=number))
    for number in range(5000):
        codec.decode(bare(ALIVE, system=number % 250 + 2, component=number // 250))
    assert len(codec.statistics.sources) == MAX_COUNTED_SOURCES
    assert codec.statistics.sources[1, 1].received == 20


def test_a_source_that_made_room_counts_anew():
    codec = Codec(1, 1)
    for number in range(MAX_COUNTED_SOURCES + 1):
        codec.decode(bare(ALIVE, system=number + 1))
    (gone,) = {(number + 1, 1) for number in range(MAX_COUNTED_SOURCES + 1)} - set(codec.statistics.sources)
    for number in (7, 8, 9):
        codec.decode(bare(ALIVE, system=gone[0], sequence=number))
    assert codec.statistics.sources[gone] == SourceStatistics(received=3)


def test_streams_that_are_found_at_once_are_limited():
    codec, kinds = Codec(1, 1), list(mavlink.mavlink_map.values())
    frames = [bare(read_frame(kind, framed(kind, b"\0", 0, (1, 1))), system=s + 1) for kind in kinds for s in range(6)]
    for frame in frames:
        assert len(codec.decode(frame)) == 1
        assert len(codec._streams) <= MAX_KNOWN_STREAMS
    assert len(frames) > MAX_KNOWN_STREAMS
    assert sum(source.received for source in codec.statistics.sources.values()) == len(frames)


def test_a_flood_depends_on_its_seed_only_and_contains_no_intact_command():
    first, second = Flood(3), Flood(3)
    data = [first.datagram() for _ in range(3000)]
    assert data == [second.datagram() for _ in range(3000)]
    assert len(first.counts) == 9
    codec = Codec(1, 1)
    targets = {getattr(m, "target_system", getattr(m, "target", 7)) for d in data for m in codec.decode(d)}
    assert targets == {7}


@pytest.mark.parametrize("message", orders(1, 1), ids=lambda m: m.get_type())
def test_one_flipped_bit_anywhere_is_detected(message):
    frame = bare(message, system=255, component=190)
    codec = Codec(1, 1)
    for bit in range(8 * len(frame)):
        damaged = bytearray(frame)
        damaged[bit // 8] ^= 1 << bit % 8
        assert codec.decode(bytes(damaged)) == []
