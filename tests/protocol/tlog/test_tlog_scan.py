"""Records are found between any bytes; every byte is a record or damage."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.generator.mavcrc import x25crc

from protocol.dialect import mavlink
from protocol.tlog import TlogReader
from protocol.tlog.message_set import message_class
from protocol.tlog.scan import TIME_LIMIT
from tests.support.logs import T0, bare, flight, log_of, record, unknown_frame

FRAMES = flight(12)
LOG = log_of(FRAMES)
STARTS = [0]
for _frame in FRAMES:
    STARTS.append(STARTS[-1] + 8 + len(_frame))


def accounted(reader):
    return int(reader.lengths.sum()) + sum(piece.length for piece in reader.damage)


def frames_of(reader):
    return [frame for _, frame in reader.records()]


def test_every_record_of_an_undamaged_log_is_found():
    reader = TlogReader(LOG)
    assert frames_of(reader) == FRAMES
    assert reader.damage == ()
    assert reader.times.tolist() == [T0 + 10_000 * k for k in range(len(FRAMES))]


def test_an_empty_log_has_no_records_and_no_damage():
    reader = TlogReader(b"")
    assert len(reader) == 0
    assert reader.damage == ()
    assert reader.columns("ATTITUDE")["roll"].shape == (0,)


def test_version_1_and_signed_frames_are_records():
    signed = bytearray(bare(mavlink.MAVLink_system_time_message(1, 2)))
    signed[2] = 1
    crc = x25crc(signed[1:-2] + bytes([mavlink.MAVLink_system_time_message.crc_extra])).crc
    signed[-2:] = struct.pack("<H", crc)
    frames = [bare(mavlink.MAVLink_ping_message(1, 2, 3, 4), version=1), bytes(signed) + bytes(13)]
    reader = TlogReader(log_of([*frames, *FRAMES]))
    assert frames_of(reader) == [*frames, *FRAMES]
    assert reader.signed.tolist()[:3] == [False, True, False]
    assert reader.versions.tolist()[:3] == [1, 2, 2]
    assert reader.decode(1).time_boot_ms == 2


def test_the_shortest_version_1_frame_is_a_record_at_the_end_of_the_file():
    frame = bare(mavlink.MAVLink_message_interval_message(0, 0), version=1)
    short = bytearray(frame[:6] + frame[-2:])  # no payload at all
    short[1] = 0
    extra = mavlink.MAVLink_message_interval_message.crc_extra
    short[-2:] = struct.pack("<H", x25crc(short[1:6] + bytes([extra])).crc)
    assert frames_of(TlogReader(LOG + record(T0, bytes(short))))[-1] == bytes(short)


def test_unknown_ids_are_kept_as_unknown():
    frame = unknown_frame(77_000, b"\x01\x02\x03")
    reader = TlogReader(log_of([FRAMES[0], frame, *FRAMES[1:], frame]))
    assert len(reader) == len(FRAMES) + 2
    assert reader.known.tolist() == [True, False, *[True] * (len(FRAMES) - 1), False]
    assert reader.ids[1] == 77_000
    assert reader.decode(1) is None
    assert reader.damage == ()


def test_an_unknown_frame_with_no_record_after_it_is_damage():
    frame = unknown_frame(77_000, b"\x01\x02\x03")
    reader = TlogReader(log_of([FRAMES[0], frame]) + b"x" * 40 + LOG)
    assert frames_of(reader) == [FRAMES[0], *FRAMES]
    assert reader.damage[0].what == "message 77000 is not in the dialect and no record follows it"


def test_an_unknown_frame_cannot_swallow_a_verified_record():
    frame = bytearray(unknown_frame(77_000, b"\x01\x02\x03"))
    frame[1] += STARTS[1]  # its length now spans the first record of the log behind it
    reader = TlogReader(record(T0, bytes(frame)) + LOG)
    assert frames_of(reader) == FRAMES


@pytest.mark.parametrize(
    ("at", "value", "what"),
    [
        (STARTS[2] + 8 + 12, None, "wrong checksum or length of "),
        (STARTS[2] + 0, 0x7F, "impossible time"),
        (STARTS[2] + 8, 0x00, "no frame where one should start"),
        (STARTS[2] + 8 + 2, 0x40, "unknown incompatibility flags 0x40"),
    ],
)
def test_one_damaged_byte_loses_one_record_and_is_described(at, value, what):
    damaged = bytearray(LOG)
    damaged[at] = damaged[at] ^ 0xFF if value is None else value
    reader = TlogReader(bytes(damaged))
    assert frames_of(reader) == FRAMES[:2] + FRAMES[3:]
    (piece,) = reader.damage
    assert (piece.offset, piece.length) == (STARTS[2], STARTS[3] - STARTS[2])
    assert piece.what.startswith(what)


def test_zeros_left_by_a_crash_are_called_zeros():
    reader = TlogReader(LOG + bytes(4096) + LOG)
    assert frames_of(reader) == FRAMES * 2
    assert [(piece.length, piece.what) for piece in reader.damage] == [(4096, "zeros")]


@pytest.mark.parametrize("left", range(1, STARTS[1]))
def test_a_truncated_last_record_is_described_as_cut_short(left):
    reader = TlogReader(LOG + LOG[:left])
    assert frames_of(reader) == FRAMES
    (piece,) = reader.damage
    assert (piece.offset, piece.length) == (len(LOG), left)
    assert piece.what in {"record cut short by the end of the file", "zeros"}


def test_a_clock_that_goes_back_is_marked_and_its_records_kept():
    times = [T0, T0 + 5, T0 + 3, T0 + 9]
    reader = TlogReader(b"".join(record(t, f) for t, f in zip(times, FRAMES, strict=False)))
    assert reader.times.tolist() == times
    assert reader.backward.tolist() == [2]


@given(data=st.binary(max_size=600))
@settings(max_examples=150, deadline=None)
def test_every_byte_is_a_record_or_damage(data):
    reader = TlogReader(data)
    assert accounted(reader) == len(data)
    assert all(reader.decode(k) is not None for k in range(len(reader)) if reader.known[k])


def positions(strategy):
    return st.lists(st.tuples(st.integers(0, len(LOG) - 1), strategy), min_size=1, max_size=4)


def survivors(touched):
    """Frames of the undamaged records."""
    spans = zip(STARTS, STARTS[1:], FRAMES, strict=False)
    return [frame for begin, end, frame in spans if not any(begin <= at < end for at in touched)]


def is_subsequence(wanted, found):
    rest = iter(found)
    return all(frame in rest for frame in wanted)


@given(flips=positions(st.integers(1, 255)))
@settings(max_examples=150, deadline=None)
def test_flipped_bytes_lose_only_the_records_they_hit(flips):
    damaged = bytearray(LOG)
    for at, mask in dict(flips).items():
        damaged[at] ^= mask
    reader = TlogReader(bytes(damaged))
    assert accounted(reader) == len(damaged)
    assert is_subsequence(survivors(dict(flips)), frames_of(reader))


@given(cut=st.tuples(st.integers(0, len(LOG)), st.integers(0, len(LOG))))
@settings(max_examples=150, deadline=None)
def test_removed_bytes_lose_only_their_records(cut):
    begin, end = sorted(cut)
    reader = TlogReader(LOG[:begin] + LOG[end:])
    assert accounted(reader) == len(LOG) - (end - begin)
    touched = set(range(begin, end)) | ({begin} if 0 < begin == end < len(LOG) else set())
    assert is_subsequence(survivors(touched), frames_of(reader))


@given(at=st.integers(0, len(LOG)), garbage=st.binary(min_size=1, max_size=400))
@settings(max_examples=150, deadline=None)
def test_inserted_bytes_lose_at_most_the_record_they_split(at, garbage):
    reader = TlogReader(LOG[:at] + garbage + LOG[at:])
    assert accounted(reader) == len(LOG) + len(garbage)
    whole = FRAMES if at in STARTS else survivors({at})
    assert is_subsequence(whole, frames_of(reader))


def test_the_time_limit_is_where_float64_loses_single_microseconds():
    assert float(TIME_LIMIT) == float(TIME_LIMIT + 1)
    assert float(TIME_LIMIT - 1) != float(TIME_LIMIT)


@pytest.mark.parametrize(("marker", "records"), [(0xFE, 3), (0xFF, 2), (0xFC, 2)])
def test_only_the_two_markers_begin_a_frame_also_of_an_unknown_message(marker, records):
    number = next(n for n in range(256) if message_class(n) is None)
    odd = bytes([marker, 3, 0, 1, 1, number]) + b"abc" + b"\x12\x34"
    reader = TlogReader(log_of([FRAMES[0], odd, FRAMES[1]]))
    assert len(reader) == records
    assert len(reader.damage) == 3 - records


def little_endian(log):
    """The same log with its time stamps in the other byte order."""
    return b"".join(struct.pack("<Q", time) + frame for time, frame in TlogReader(log).records())


def test_little_endian_time_stamps_are_read():
    reader = TlogReader(little_endian(LOG))
    assert (reader.byte_order, TlogReader(LOG).byte_order) == ("little", "big")
    assert (frames_of(reader), reader.damage) == (FRAMES, ())
    assert reader.times.tolist() == [T0 + 10_000 * k for k in range(len(FRAMES))]


def test_damage_of_a_little_endian_log_is_skipped_and_described():
    log = little_endian(LOG * 4)
    junk = log[: len(log) // 2] + b"junk" + log[len(log) // 2 : -3]
    reader = TlogReader(junk)
    assert accounted(reader) == len(junk)
    assert len(reader) == 4 * len(FRAMES) - 1 - (len(log) // 2 != STARTS[-1] * 2)
    assert reader.damage[-1].what == "record cut short by the end of the file"


@given(data=st.binary(max_size=300))
@settings(max_examples=60, deadline=None)
def test_every_byte_behind_a_little_endian_log_is_a_record_or_damage(data):
    reader = TlogReader(little_endian(LOG) + data)
    assert accounted(reader) == reader.size
    assert frames_of(reader)[: len(FRAMES)] == FRAMES


@pytest.mark.parametrize("time", [256, 31 << 8, 1 << 40, T0 // 256 * 256])
def test_a_time_that_either_byte_order_allows_is_read_big_endian(time):
    """Stamps of a simulation's clock may be possible both ways: the usual order counts."""
    reader = TlogReader(b"".join(record(time, frame) for frame in FRAMES))
    assert (reader.byte_order, set(reader.times.tolist())) == ("big", {time})


def test_a_part_of_a_log_with_stamps_of_the_other_byte_order_is_named():
    reader = TlogReader(LOG * 3 + little_endian(LOG))
    assert frames_of(reader)[: 3 * len(FRAMES)] == FRAMES * 3
    assert any("but for little-endian stamps as only a part of the file has" in piece.what for piece in reader.damage)
