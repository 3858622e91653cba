"""NatNet packets: what is written is read, by the library too; damaged and hostile ones are none, at once."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from natnet import DataDescriptions, DataFrame, ServerInfo, Version
from natnet.packet_buffer import PacketBuffer

from protocol.natnet import (
    BIT_STREAMS,
    CLOCK,
    MAX_PLACE,
    Address,
    BodyPose,
    BodyReading,
    CaptureFrame,
    FrameReading,
    Packet,
    descriptions,
    frame_packet,
    packet,
    read_body_names,
    read_frame,
    read_server,
    request,
    response,
    server_info,
)
from tests.support.motion_capture.hall import cameras, frames_of

BODY = cameras(ideal=True).body
POSE = BodyPose((1.5, -2.25, 0.5), (0.5, -0.5, 0.5, 0.5), 0.25, is_tracked=True)
FRAME = CaptureFrame(12, 10 * CLOCK, 11 * CLOCK, 12 * CLOCK, POSE, ((1, (1.0, 2.0, 3.0)), (3, (4.0, 5.0, 6.0))))
EVERY_BIT_STREAM = pytest.mark.parametrize("version", BIT_STREAMS, ids=str)
CAMERAS = cameras(ideal=True, delay=0.02)
CAPTURED = frames_of(CAMERAS, 0.1)[-1]
WHOLE = {version: frame_packet(CAPTURED, CAMERAS.body, version) for version in BIT_STREAMS}
VERSIONS = st.sampled_from(BIT_STREAMS)
HUGE = b"\xff\xff\xff\x7f"


def as_unit(q):
    """A quaternion of size 1, as precise as a packet holds it."""
    return struct.unpack("<4f", struct.pack("<4f", *(x / math.hypot(*q) for x in q)))


PLACES = st.tuples(*3 * [st.floats(-MAX_PLACE, MAX_PLACE, width=32)])
UNITS = st.tuples(*4 * [st.floats(-1.0, 1.0)]).filter(lambda q: math.hypot(*q) > 0.1).map(as_unit)
POSES = st.builds(BodyPose, PLACES, UNITS, st.floats(0.0, 10.0, width=32), is_tracked=st.booleans())
STAMPS = st.tuples(*3 * [st.integers(1, 2**62)]).map(sorted)
MARKERS = st.lists(st.tuples(st.integers(1, 8), PLACES), max_size=8).map(tuple)
FRAMES = st.builds(
    lambda number, stamps, pose, markers: CaptureFrame(number, *stamps, pose, markers),
    st.integers(0, 2**31 - 1), STAMPS, POSES, MARKERS,
)  # fmt: skip


@given(FRAMES, VERSIONS)
def test_a_frame_that_is_written_is_read(frame, version):
    pose, (x, y, z, w) = frame.body, frame.body.attitude
    size = math.hypot(x, y, z, w)
    body = BodyReading(BODY.number, pose.position, (w / size, x / size, y / size, z / size), *pose[2:])
    times = frame.exposed / CLOCK, frame.transmitted / CLOCK
    read = read_frame(frame_packet(frame, BODY, version), version, CLOCK)
    assert read == FrameReading(frame.number, (body,), *times, models_changed=False)


@given(VERSIONS, st.integers(1, 65535), st.sampled_from(["", "239.255.42.99", "224.0.0.1"]))
def test_a_server_that_is_written_is_read(version, port, group):
    server = read_server(server_info(version, Address(port, group)))
    assert server[2:] == (version, CLOCK, port, group)


def payload(data, kind):
    found, size = struct.unpack_from("<HH", data)
    assert (found, size) == (kind, len(data) - 4)
    return PacketBuffer(data[4:])


@EVERY_BIT_STREAM
def test_a_frame_is_read_to_its_last_byte(version):
    buffer = payload(frame_packet(FRAME, BODY, version), Packet.FRAME)
    frame = DataFrame.read_from_buffer(buffer, Version(*version))
    # The end tag; and natnet 0.3 does not know of the network clock's time, which is zero, as the parameters are.
    assert len(buffer.data) - buffer.pointer == (12 if version >= (4, 1) else 4)
    body = frame.rigid_bodies[0]
    assert (body.id_num, body.pos, body.rot) == (1, POSE.position, POSE.attitude)
    assert (body.marker_error, body.tracking_valid) == (0.25, True)
    assert [(m.model_id, m.marker_id, m.pos, m.has_model) for m in frame.labeled_markers] == [
        (1, 1, (1.0, 2.0, 3.0), True), (1, 3, (4.0, 5.0, 6.0), True)
    ]  # fmt: skip
    assert frame.marker_sets[0].marker_pos_list == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
    suffix = frame.suffix
    stamps = (suffix.stamp_camera_mid_exposure, suffix.stamp_data_received, suffix.stamp_transmit)
    assert (frame.prefix.frame_number, suffix.timestamp, stamps) == (12, 10.0, FRAME[1:4])
    assert not suffix.is_recording
    assert not suffix.tracked_models_changed


@EVERY_BIT_STREAM
def test_a_body_that_is_not_tracked_says_so(version):
    lost = FRAME._replace(body=POSE._replace(is_tracked=False), markers=())
    frame = DataFrame.read_from_buffer(payload(frame_packet(lost, BODY, version), Packet.FRAME), Version(*version))
    assert not frame.rigid_bodies[0].tracking_valid
    assert frame.labeled_markers == ()


@EVERY_BIT_STREAM
def test_the_body_is_described_with_its_markers(version):
    buffer = payload(descriptions(BODY, version), Packet.DESCRIPTIONS)
    read = DataDescriptions.read_from_buffer(buffer, Version(*version))
    assert buffer.pointer == len(buffer.data)
    body = read.rigid_bodies[0]
    assert (body.name, body.id_num, body.pos) == ("DarkO", 1, (0.0, 0.0, 0.0))
    assert [marker.pos for marker in body.markers] == [pytest.approx(place) for place in BODY.streamed_markers]
    assert [marker.name for marker in body.markers] == (list(BODY.marker_names) if version >= (4, 0) else [None] * 4)
    assert read.marker_sets[0].marker_names == BODY.marker_names


@pytest.mark.parametrize(("version", "motive"), [((3, 1), "2.1.0.0"), ((4, 1), "3.1.0.0")])
def test_the_server_tells_its_versions_its_clock_and_where_frames_go(version, motive):
    data = server_info(version, Address(1511, "239.255.42.99"))
    info = ServerInfo.read_from_buffer(payload(data, Packet.SERVER_INFO), None)
    assert (info.application_name, str(info.server_version)) == ("Motive", motive)
    assert info.nat_net_protocol_version == Version(*version)
    assert struct.unpack_from("<QHB4B", data, 4 + 264) == (CLOCK, 1511, 1, 239, 255, 42, 99)
    assert struct.unpack_from("<QHB4B", server_info(version, Address(1511)), 4 + 264)[2:] == (0, 0, 0, 0, 0)


def test_a_response_is_a_code_or_a_number():
    assert response(0) == struct.pack("<HHi", 3, 4, 0)
    assert response(240.0) == struct.pack("<HHf", 3, 4, 240.0)


def test_without_a_clock_a_frame_has_no_times():
    frame = read_frame(WHOLE[3, 1], (3, 1), 0)
    assert (frame.exposed, frame.transmitted) == (None, None)


@EVERY_BIT_STREAM
def test_bodies_are_known_by_name(version):
    assert read_body_names(descriptions(CAMERAS.body, version), version) == {"DarkO": 1}


def test_the_server_is_known_with_and_without_its_later_fields():
    data = server_info((4, 1), Address(1511, "239.255.42.99"))
    server = read_server(data)
    assert (server.name, server.application, server.version) == ("Motive", "3.1", (4, 1))
    assert (server.clock, server.data_port, server.group) == (CLOCK, 1511, "239.255.42.99")
    assert read_server(data[: 4 + 264])[3:] == (0, 0, "")
    assert read_server(data[:200]) is None


@given(VERSIONS, st.data())
def test_a_frame_that_is_cut_off_is_none_unless_only_its_end_is_missing(version, data):
    whole = WHOLE[version]
    cut = data.draw(st.integers(0, len(whole) - (13 if version >= (4, 1) else 5)))
    assert read_frame(whole[:cut], version, CLOCK) is None


@given(VERSIONS, st.data())
def test_a_frame_with_bytes_changed_raises_nothing(version, data):
    damaged = bytearray(WHOLE[version])
    for _ in range(data.draw(st.integers(1, 8))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    frame = read_frame(bytes(damaged), version, CLOCK)
    assert frame is None or all(abs(x) < 1e5 for body in frame.bodies for x in body.position)


@given(VERSIONS, st.integers(0, 120), st.sampled_from([5, 7]))
def test_a_packet_that_claims_more_than_it_holds_gives_no_more_than_is_there(version, at, kind):
    whole = WHOLE[version] if kind == Packet.FRAME else descriptions(CAMERAS.body, version)
    at = min(4 + 4 * (at // 4), len(whole) - 4)
    hostile = whole[:at] + HUGE + whole[at + 4 :]
    frame, names = read_frame(hostile, version, CLOCK), read_body_names(hostile, version)
    if kind == Packet.FRAME:
        assert names is None
        assert frame is None or (len(frame.bodies) <= 1 and all(abs(x) < 1e5 for b in frame.bodies for x in b.position))
    else:
        assert frame is None
        assert names is None or len(names) <= 1


@EVERY_BIT_STREAM
def test_a_packet_of_countless_parts_is_none_at_once(version):
    frame, names = WHOLE[version], descriptions(CAMERAS.body, version)
    assert read_frame(frame[:8] + HUGE + frame[12:], version, CLOCK) is None
    assert read_body_names(names[:4] + HUGE + names[8:], version) is None


def test_counts_beyond_the_packet_and_texts_without_an_end_are_none():
    hostile = [packet(Packet.DESCRIPTIONS, struct.pack("<ii", 1, 0) + b"name"),
               packet(Packet.DESCRIPTIONS, struct.pack("<ii", 1, 0) + b"n\0" + HUGE + 100 * b"\0"),
               packet(Packet.DESCRIPTIONS, struct.pack("<ii", 1, 3) + 4 * b"\0" + b"plate\0" + 8 * b"\0")]  # fmt: skip
    assert [read_body_names(data, (3, 1)) for data in hostile] == [None] * 3


def test_a_body_that_is_not_of_numbers_is_left_out():
    nan = CAPTURED._replace(body=CAPTURED.body._replace(position=(float("nan"), 0.0, 0.0)))
    zero = CAPTURED._replace(body=CAPTURED.body._replace(attitude=(0.0, 0.0, 0.0, 0.0)))
    never = zero._replace(body=zero.body._replace(is_tracked=False))
    read = [read_frame(frame_packet(f, CAMERAS.body, (3, 1)), (3, 1), CLOCK).bodies for f in (nan, zero, never)]
    assert [len(bodies) for bodies in read] == [0, 0, 1]


def test_a_request_has_its_size_and_an_end():
    assert request(Packet.CONNECT, "Ping") == struct.pack("<HH", 0, 5) + b"Ping\0"
