"""Counts of lost and repeated frames in the codec, at the edges of its windows."""

import pytest

from protocol.dialect import mavlink
from protocol.wire.codec import Codec, SourceStatistics


def frame(number, source=(1, 1)):
    codec = Codec(*source)
    for _ in range(number):
        codec.encode(mavlink.MAVLink_heartbeat_message(19, 12, 81, 0, 4, 3))
    return codec.encode(mavlink.MAVLink_heartbeat_message(19, 12, 81, number, 4, 3))


def counted(*numbers):
    codec = Codec(255, 190)
    for number in numbers:
        codec.decode(frame(number))
    return codec.statistics.sources[1, 1]


def test_nothing_is_counted_before_the_first_frame():
    assert SourceStatistics() == SourceStatistics(received=0, lost=0, repeated=0)


@pytest.mark.parametrize(("ahead", "lost"), [(127, 126), (128, 0), (200, 0)])
def test_from_half_the_range_on_a_frame_is_late_and_not_ahead(ahead, lost):
    """Nothing is missing before the first frame, so a late one has been there already."""
    assert counted(0, ahead) == SourceStatistics(received=2, lost=lost, repeated=int(lost == 0))


def test_a_frame_is_recognised_half_the_range_later():
    assert counted(0, 64, 128, 0) == SourceStatistics(received=4, lost=126, repeated=1)
    assert counted(0, 64, 128, 1) == SourceStatistics(received=4, lost=125)


def test_64_sources_are_counted_and_one_more_replaces_the_one_with_fewest_frames():
    codec = Codec(255, 190)
    for system in range(1, 65):
        for number in range(1 if system == 40 else 2):
            codec.decode(frame(number, (system, 1)))
    assert len(codec.statistics.sources) == 64
    codec.decode(frame(0, (65, 1)))
    assert set(codec.statistics.sources) == {(system, 1) for system in range(1, 66)} - {(40, 1)}


@pytest.mark.parametrize(("false_starts", "read"), [(31, 1), (32, 0)])
def test_a_datagram_is_searched_until_32_bytes_only_looked_like_a_frame(false_starts, read):
    codec = Codec(255, 190)
    junk = b"\xfd" * false_starts
    assert len(codec.decode(junk + b"\0" * 300 + frame(0))) == read
