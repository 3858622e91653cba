"""Packets of Motive, as the library natnet reads them in every bit-stream."""

import struct

import pytest
from natnet import DataDescriptions, DataFrame, ServerInfo, Version
from natnet.packet_buffer import PacketBuffer

from sitl.motion_capture.capture_frame import CLOCK, BodyPose, CaptureFrame
from sitl.motion_capture.natnet_packets import (
    BIT_STREAMS,
    Address,
    Packet,
    descriptions,
    frame_packet,
    response,
    server_info,
)
from tests.support.motion_capture.hall import cameras

BODY = cameras(ideal=True).body
POSE = BodyPose((1.5, -2.25, 0.5), (0.5, -0.5, 0.5, 0.5), 0.25, is_tracked=True)
FRAME = CaptureFrame(12, 10 * CLOCK, 11 * CLOCK, 12 * CLOCK, POSE, ((1, (1.0, 2.0, 3.0)), (3, (4.0, 5.0, 6.0))))
EVERY_BIT_STREAM = pytest.mark.parametrize("version", BIT_STREAMS, ids=str)


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
