"""Encoding and decoding: messages, statistics, and damage that never raises an error."""

import struct
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.generator.mavcrc import x25crc

from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError
from protocol.wire.codec import Codec, SourceStatistics, Statistics
from tests.support.links.link import Link, plan
from tests.support.logs import bare, quadplane_log
from tests.support.paths import DATA


def heartbeat(mode: int = 0):
    return mavlink.MAVLink_heartbeat_message(19, 12, 81, mode, 4, 3)


def frames(count: int, codec: Codec | None = None) -> list[bytes]:
    codec = codec or Codec(1, 1)
    return [codec.encode(heartbeat(n)) for n in range(count)]


def modes(messages) -> list[int]:
    return [message.custom_mode for message in messages]


def test_a_message_is_decoded_with_its_source_and_raw_bytes():
    (frame,) = frames(1, Codec(7, 9))
    (message,) = Codec(255, 190).decode(frame)
    assert message.to_dict() == heartbeat().to_dict()
    assert (message.get_srcSystem(), message.get_srcComponent()) == (7, 9)
    assert bytes(message.get_msgbuf()) == frame


def test_one_datagram_may_hold_many_frames():
    assert modes(Codec(255, 190).decode(b"".join(frames(5)))) == [0, 1, 2, 3, 4]


def test_a_truncated_frame_swallows_neither_the_next_frame_nor_the_next_datagram():
    first, second, third = frames(3)
    codec = Codec(255, 190)
    assert modes(codec.decode(first[:15] + second)) == [1]
    assert modes(codec.decode(first[:15])) == []
    assert modes(codec.decode(third)) == [2]


def test_both_versions_are_read():
    version_1 = bare(heartbeat(11), version=1, system=3)
    assert version_1[0] == 0xFE
    assert modes(Codec(255, 190).decode(version_1 + frames(1)[0])) == [11, 0]


def test_untrimmed_and_longer_payloads_are_read():
    def with_payload(payload: bytes) -> bytes:
        head = struct.pack("<BBBBBBHB", len(payload), 0, 0, 0, 1, 1, 0, 0)
        crc = x25crc(head + payload + bytes([mavlink.MAVLink_heartbeat_message.crc_extra])).crc
        return b"\xfd" + head + payload + struct.pack("<H", crc)

    body = struct.pack("<IBBBBB", 0, 19, 12, 81, 0, 0)
    for payload in (body, body.rstrip(b"\0"), body + b"later extension"):
        (message,) = Codec(255, 190).decode(with_payload(payload))
        assert message.type == 19
        assert message.system_status == 0


def test_a_bad_checksum_is_counted_once_and_changes_nothing_else():
    damaged = bytearray(frames(1)[0])
    damaged[12] ^= 0xFF
    codec = Codec(255, 190)
    assert codec.decode(bytes(damaged)) == []
    statistics = codec.statistics
    assert (statistics.bad_crc, statistics.garbage_bytes, statistics.received) == (1, len(damaged), 0)
    assert dict(statistics.sources) == {}


def test_a_damaged_frame_counts_once_even_if_its_payload_looks_like_frames():
    inner = bytes([0xFE, 0, 0, 1, 1, 0, 9, 9]) * 4  # four empty HEARTBEATs with wrong checksums
    damaged = bytearray(Codec(1, 1).encode(mavlink.MAVLink_statustext_message(4, inner)))
    damaged[-1] ^= 0xFF
    codec = Codec(255, 190)
    assert modes(codec.decode(bytes(damaged) + frames(1)[0])) == [0]
    assert codec.statistics.bad_crc == 1


def test_a_truncated_unknown_message_does_not_swallow_the_next_frame():
    """Its checksum cannot be verified: only the bytes behind it show whether its length is right."""
    unknown = bytes([0xFE, 20, 0, 1, 1, 199, 1, 2, 3])
    codec = Codec(255, 190)
    assert modes(codec.decode(unknown + b"".join(frames(2)))) == [0, 1]
    assert codec.statistics.unknown_id == 0


def test_an_unknown_incompatibility_flag_drops_only_its_frame():
    flagged, good = (bytearray(frame) for frame in frames(2))
    flagged[2] = 0x02
    codec = Codec(255, 190)
    assert modes(codec.decode(bytes(flagged + good))) == [1]
    assert codec.statistics.bad_flags == 1


def test_an_unknown_message_is_counted_and_is_not_a_loss():
    first, second, third = (bytearray(frame) for frame in frames(3))
    second[7:10] = (65_000).to_bytes(3, "little")
    codec = Codec(255, 190)
    assert modes(codec.decode(bytes(first + second + third))) == [0, 2]
    assert codec.statistics.unknown_id == 1
    assert codec.statistics.sources[1, 1] == SourceStatistics(received=3)


@pytest.mark.parametrize(
    ("order", "expected"),
    [
        ([0, 1, 2, 3], SourceStatistics(received=4)),
        ([0, 3], SourceStatistics(received=2, lost=2)),
        ([0, 1, 1, 2], SourceStatistics(received=4, repeated=1)),
        ([0, 2, 1, 3], SourceStatistics(received=4)),
        ([0, 2, 1, 1, 3], SourceStatistics(received=5, repeated=1)),
        ([5, 4, 6], SourceStatistics(received=3, repeated=1)),  # nothing before the first can be missing
    ],
)
def test_loss_and_repetition_follow_the_sequence_numbers(order, expected):
    sent, codec = frames(8), Codec(255, 190)
    for number in order:
        codec.decode(sent[number])
    assert codec.statistics.sources[1, 1] == expected


def test_sequence_numbers_wrap_without_loss():
    codec = Codec(255, 190)
    for frame in frames(600):
        codec.decode(frame)
    assert codec.statistics.sources[1, 1] == SourceStatistics(received=600)


@settings(max_examples=60, deadline=None)
@given(kept=st.lists(st.booleans(), min_size=1, max_size=300), swaps=st.randoms(use_true_random=False))
def test_only_dropped_frames_count_as_lost(kept, swaps):
    sent = [frame for frame, keep in zip(frames(len(kept)), kept, strict=True) if keep]
    shuffled = [sent[i : i + 6] for i in range(0, len(sent), 6)]
    for group in shuffled[1:]:
        swaps.shuffle(group)
    gaps = "".join("1" if keep else "0" for keep in kept).strip("0").split("1")
    if max((len(gap) for gap in gaps), default=0) > 100:
        return  # beyond half the range, behind and ahead look the same
    codec = Codec(255, 190)
    if shuffled:
        swaps.shuffle(shuffled[0][1:])
    for group in shuffled:
        for frame in group:
            codec.decode(frame)
    if sent:
        assert codec.statistics.sources[1, 1] == SourceStatistics(len(sent), sum(map(len, gaps)), 0)


def test_sources_are_counted_separately():
    codec = Codec(255, 190)
    for frame in [*frames(3, Codec(1, 1)), *frames(2, Codec(1, 100)), *frames(1, Codec(2, 1))]:
        codec.decode(frame)
    assert {k: v.received for k, v in codec.statistics.sources.items()} == {(1, 1): 3, (1, 100): 2, (2, 1): 1}


def test_statistics_are_a_snapshot():
    codec = Codec(255, 190)
    before = codec.statistics
    codec.decode(frames(1)[0])
    assert before == Statistics()
    assert codec.statistics.received == 1


def test_encoding_does_not_modify_the_message():
    message = heartbeat()
    before = dict(message.__dict__)
    Codec(1, 1).encode(message)
    assert message.__dict__ == before


def test_a_value_that_does_not_fit_raises_and_uses_no_sequence_number():
    codec = Codec(1, 1)
    with pytest.raises(LocalProtocolError, match="HEARTBEAT"):
        codec.encode(heartbeat(-1))
    (message,) = Codec(255, 190).decode(codec.encode(heartbeat()))
    assert message.get_seq() == 0


@pytest.mark.parametrize("ids", [(256, 1), (1, -1)])
def test_ids_outside_a_byte_are_refused(ids):
    with pytest.raises(LocalProtocolError):
        Codec(*ids)


@settings(max_examples=200, deadline=None)
@given(data=st.binary(max_size=400) | st.lists(st.sampled_from([0xFD, 0xFE, 0, 1, 9]), max_size=400).map(bytes))
def test_random_bytes_never_raise_and_every_byte_is_counted(data):
    codec = Codec(255, 190)
    used = sum(len(message.get_msgbuf()) for message in codec.decode(data))
    statistics = codec.statistics
    assert statistics.bytes_received == len(data)
    assert used + statistics.garbage_bytes <= len(data)
    assert (used + statistics.garbage_bytes == len(data)) or statistics.unknown_id


@settings(max_examples=150, deadline=None)
@given(
    position=st.integers(0, 10_000),
    bits=st.integers(1, 255),
    cut=st.integers(0, 60),
    tail=st.binary(max_size=20),
)
def test_damaged_traffic_never_raises_and_gives_the_vehicle_no_commands(position, bits, cut, tail):
    """The checksum detects every damaged byte: no command, plan or parameter results from it."""
    vehicle = Link(items=plan(2)).vehicle
    ground = Codec(255, 190)
    orders = [
        mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_mission_clear_all_message(1, 1),
        mavlink.MAVLink_param_set_message(1, 1, b"K_1", 3.0, 9),
        mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11),
    ]
    frame = bytearray(ground.encode(orders[position % 4]))
    frame[1 + position % (len(frame) - 1)] ^= bits
    data = bytes(frame[: len(frame) - cut] if cut < len(frame) else frame) + tail
    parameters = vehicle.endpoint.parameters
    vehicle.endpoint.receive_datagram(data, "ground", 0.0)
    assert vehicle.endpoint.events() == []
    assert vehicle.endpoint.mission == plan(2)
    assert vehicle.endpoint.parameters == parameters


def square_log():
    return (DATA / "square-flight.tlog").read_bytes()


@pytest.mark.parametrize("log", [square_log, quadplane_log])
def test_a_recorded_flight_is_read_frame_by_frame(log):
    """The codec must find the same frames as the lengths in the log."""
    data, codec, at, read = log(), Codec(255, 190), 0, Counter()
    while at + 8 < len(data):
        start, marker = at + 8, data[at + 8]
        size = data[start + 1] + (8 if marker == 0xFE else 12 + 13 * (data[start + 2] & 1))
        assert marker in {0xFD, 0xFE}
        read["frames"] += 1
        read["messages"] += len(codec.decode(data[start : start + size]))
        at = start + size
    statistics = codec.statistics
    assert read["frames"] > 1000
    assert read["messages"] + statistics.unknown_id == read["frames"]
    assert statistics.received == read["messages"]
    assert (statistics.bad_crc, statistics.bad_flags, statistics.garbage_bytes) == (0, 0, 0)
    assert sum(source.received for source in statistics.sources.values()) <= read["frames"]
