"""The reader agrees with the dialect's own codec, message by message."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as all_dialects
from pymavlink.generator.mavcrc import x25crc

from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.tlog import TlogReader, message_name, read_tlog
from protocol.tlog.message_set import message_class, message_named
from protocol.tlog.reader import payload_type
from protocol.tlog.scan import checksums
from protocol.wire.codec import Codec
from tests.support.logs import T0, bare, flight, log_of, quadplane_log, record, unknown_frame
from tests.support.vehicle.darko_messages import actuators

FRAMES = flight(12)


def decoded(frame):
    (message,) = Codec(255, 190).decode(frame)
    return message


def same(ours, theirs):
    """Equality in which NaN equals NaN and a numpy row equals a list."""
    return np.array_equal(np.asarray(ours), np.asarray(theirs), equal_nan=np.asarray(theirs).dtype.kind == "f")


def test_the_structured_type_of_every_message_has_the_size_of_its_payload():
    every = mavlink.mavlink_map.values()
    assert [known.msgname for known in every if payload_type(known).itemsize != known.unpacker.size] == []
    assert [known.msgname for known in every if set(payload_type(known).names) != set(known.fieldnames)] == []


@pytest.mark.long
@given(
    payloads=st.lists(
        st.tuples(st.sampled_from(sorted(mavlink.mavlink_map)), st.binary(max_size=255)), min_size=1, max_size=8
    ),
    version=st.sampled_from([1, 2]),
)
@settings(max_examples=150, deadline=None)
def test_columns_hold_what_the_codec_decodes(payloads, version):
    frames = [framed(number, payload, version) for number, payload in payloads if version == 2 or number < 256]
    reader = TlogReader(log_of(frames))
    assert [frame for _, frame in reader.records()] == frames
    for name in {decoded(frame).get_type() for frame in frames}:
        columns, messages = reader.columns(name), [reader.decode(row) for row in reader.rows(name)]
        for field, column in columns.items():
            assert reader.columns(name)[field].tobytes() == column.tobytes()  # alone as with all others
            for ours, message in zip(column, messages, strict=True):
                if column.dtype.kind == "S":
                    raw = message.__dict__.get(f"_{field}_raw", getattr(message, field))
                    assert ours == (raw if isinstance(raw, bytes) else raw.encode())
                else:
                    assert same(ours, getattr(message, field))


def framed(number, payload, version):
    """A frame with a payload of any length and a right checksum."""
    extra = bytes([mavlink.mavlink_map[number].crc_extra])
    if version == 1:
        head = bytes([0xFE, len(payload), 7, 1, 1, number])
    else:
        head = bytes([0xFD, len(payload), 0, 0, 7, 1, 1]) + number.to_bytes(3, "little")
    return head + payload + x25crc(head[1:] + payload + extra).crc.to_bytes(2, "little")


@given(
    spans=st.lists(st.tuples(st.integers(0, 100), st.integers(1, 90)), max_size=30),
    data=st.binary(min_size=200, max_size=200),
)
@settings(max_examples=60, deadline=None)
def test_checksums_of_many_spans_are_those_of_each(spans, data):
    offsets, lengths = (np.array([span[k] for span in spans], dtype=(np.int64, np.uint16)[k]) for k in (0, 1))
    crcs = checksums(np.frombuffer(data, dtype=np.uint8), offsets, lengths)
    assert crcs.tolist() == [x25crc(data[at : at + length]).crc for at, length in spans]


def test_trimmed_zeros_are_restored_and_nan_stays_nan():
    messages = [mavlink.MAVLink_attitude_message(5, roll, 0.0, 0.0, 0.0, 0.0, 0.0) for roll in (1.5, 0.0, math.nan)]
    columns = TlogReader(log_of(map(bare, messages))).columns("ATTITUDE")
    assert columns["time_boot_ms"].tolist() == [5, 5, 5]
    assert same(columns["roll"], np.array([1.5, 0.0, math.nan], dtype=np.float32))
    assert columns["yawspeed"].tolist() == [0.0, 0.0, 0.0]


def test_array_fields_have_one_row_per_message():
    columns = TlogReader(log_of(map(bare, [actuators(1, limits=3)] * 3))).columns("DARKO_ACTUATORS")
    assert columns["motor_speed"].tolist() == [[2.0, 3.0]] * 3
    assert columns["limits"].tolist() == [3, 3, 3]


def test_rows_and_columns_are_chosen_by_source():
    message = mavlink.MAVLink_heartbeat_message(19, 12, 129, 0, 4, 3)
    frames = [bare(message, system=system, component=component) for system, component in [(1, 1), (255, 190), (1, 1)]]
    reader = TlogReader(log_of(frames))
    assert reader.rows("HEARTBEAT").tolist() == [0, 1, 2]
    assert reader.rows("HEARTBEAT", (1, 1)).tolist() == [0, 2]
    assert len(reader.columns("HEARTBEAT", (255, 190))["type"]) == 1
    assert reader.systems.tolist() == [1, 255, 1]
    assert reader.components.tolist() == [1, 190, 1]


def test_a_message_that_no_dialect_has_raises():
    with pytest.raises(LocalProtocolError, match="no message 'AHRS99'"):
        TlogReader(b"").columns("AHRS99")


def test_messages_of_other_autopilots_are_decoded_and_verified():
    """ArduPilot's WIND is in pymavlink's dialect ``all`` alone."""
    wind = all_dialects.MAVLink_wind_message(direction=270.0, speed=5.0, speed_z=0.5)
    frame = wind.pack(all_dialects.MAVLink(None, srcSystem=1, srcComponent=1))
    wrong = bytes([*frame[:-1], frame[-1] ^ 1])
    reader = TlogReader(log_of([FRAMES[0], frame, wrong, frame]))
    assert reader.known.tolist() == [True] * 3
    assert reader.decode(1).speed == reader.columns("WIND")["speed"][0] == 5.0
    assert [piece.what for piece in reader.damage] == ["wrong checksum or length of WIND"]


def test_a_column_is_decoded_when_it_is_asked_for_and_kept():
    reader = TlogReader(log_of(FRAMES))
    columns = reader.columns("ATTITUDE")
    alone = columns["roll"]
    assert columns["roll"] is alone
    assert alone.flags.c_contiguous  # nothing of the other fields is kept
    assert all(same(values, reader.columns("ATTITUDE")[name]) for name, values in columns.items())
    assert set(columns) == set(mavlink.MAVLink_attitude_message.fieldnames)
    assert "nonsense" not in columns


def test_message_names_come_from_the_dialect_or_are_unknown():
    assert message_name(0) == "HEARTBEAT"
    assert message_name(77_000) == "UNKNOWN_77000"


def test_a_log_is_read_from_its_file(tmp_path):
    path = tmp_path / "flight.tlog"
    path.write_bytes(log_of(flight(5)))
    reader = read_tlog(path)
    assert len(reader) == 5
    assert reader.size == path.stat().st_size
    assert reader.times[0] == T0


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"", "the file is empty"),
        (b"time,roll\n1,2\n" * 20, "not a telemetry log: it is a text file"),
        (b"".join(flight(5)), "it begins with bare MAVLink frames"),
        (b"ULog\x01\x12\x35\x01" + bytes(40), "it is a PX4 ULog file"),
        (b"\xa3\x95\x80" + bytes(40), "it is an ArduPilot dataflash log"),
        (bytes(100) + unknown_frame(77_000, b"ab"), "its 114 bytes hold no valid record"),
        (bytes(100), "its 100 bytes hold no valid record"),
    ],
    ids=["empty", "text", "bare frames", "ulog", "dataflash", "chance", "zeros"],
)
def test_a_file_that_is_not_a_log_is_refused_with_a_guess(tmp_path, content, complaint):
    path = tmp_path / "some.tlog"
    path.write_bytes(content)
    with pytest.raises(FileError, match=complaint):
        read_tlog(path)


def test_a_missing_file_is_a_file_error(tmp_path):
    with pytest.raises(FileError, match=r"none\.tlog: cannot be read: No such file"):
        read_tlog(tmp_path / "none.tlog")


def test_a_log_with_unknown_ids_alone_is_a_log():
    reader = TlogReader(log_of([unknown_frame(77_000, b"ab")] * 3))
    assert reader.known.tolist() == [False] * 3


def test_another_autopilots_log_is_read_like_the_codec_does():
    """A recording of 23,894 version 1 frames, a quarter of them of messages that our dialect has not."""
    data = quadplane_log()
    reader = TlogReader(data)
    assert reader.damage == ()
    assert len(reader.backward) == 0
    mav, at, count = all_dialects.MAVLink(None), 0, 0
    while at < len(data):
        end = at + 16 + data[at + 9]
        assert int(reader.offsets[count]) == at
        assert int(reader.times[count]) == int.from_bytes(data[at : at + 8])
        message = mav.decode(bytearray(data[at + 8 : end]))
        assert reader.ids[count] == data[at + 13] == message.get_msgId()
        at, count = end, count + 1
    assert count == len(reader)
    assert reader.known.all()
    for name, field in (("ATTITUDE", "roll"), ("AHRS2", "altitude")):
        decoded_one_by_one = [getattr(reader.decode(row), field) for row in reader.rows(name)]
        assert reader.columns(name)[field].tolist() == decoded_one_by_one != []


def test_damage_in_a_log_loses_only_the_damaged_records():
    data = bytearray(quadplane_log())
    whole = TlogReader(bytes(data))
    begin, end = 300_000, 301_000
    data[begin:end] = b"\xfe" * (end - begin)
    reader = TlogReader(bytes(data))
    hit = (whole.offsets < end) & (whole.offsets + whole.lengths > begin)
    assert set(whole.offsets[~hit & whole.known].tolist()) <= set(reader.offsets.tolist())
    assert len(reader.damage) == 1
    assert int(reader.lengths.sum()) + reader.damage[0].length == len(data)


def test_messages_of_other_dialects_are_known_beside_our_own():
    assert message_name(163) == "AHRS"
    assert 163 not in mavlink.mavlink_map
    assert message_class(163).msgname == "AHRS"
    assert message_class(30) is mavlink.mavlink_map[30]
    assert message_named("AHRS") is message_class(163)
    assert message_named("ATTITUDE") is mavlink.mavlink_map[30]


def test_a_part_of_a_log_is_read_as_a_log_of_these_records_alone():
    frames = flight(20)
    whole = TlogReader(log_of(frames))
    chosen = np.arange(20) % 3 == 0
    part = whole.only(chosen)
    again = TlogReader(b"".join(record(int(t), f) for t, f in part.records()))
    assert [frame for _, frame in part.records()] == frames[::3]
    assert (part.names, part.clock.duration) == (again.names, again.clock.duration)
    for name in part.names:
        for field, values in again.columns(name).items():
            assert part.columns(name)[field].tolist() == values.tolist()
    assert (part.size, part.damage) == (whole.size, whole.damage)


def test_a_part_of_a_log_has_the_times_of_the_whole():
    whole = TlogReader(log_of(flight(20)))
    part = whole.only(np.arange(20) >= 5)
    assert part.clock.playing.tolist() == whole.clock.playing[5:].tolist()
    assert part.clock.start_usec == whole.clock.start_usec
