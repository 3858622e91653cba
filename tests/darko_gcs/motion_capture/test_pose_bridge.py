"""The bridge: which body, how often, when it stops, what it says, and nothing that disturbs it."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from darko_gcs.motion_capture.bridge_links import AutopilotLink, NatnetLink
from darko_gcs.motion_capture.pose_bridge import BridgeSettings, PoseBridge
from protocol.dialect import mavlink
from protocol.natnet import descriptions, frame_packet, server_info
from protocol.wire.codec import Codec
from protocol.wire.signing import Keyring
from tests.support.motion_capture.hall import UNICAST, cameras, frames_of
from tests.support.motion_capture.stream import BEGAN, Stream

FRAMES = frames_of(cameras(ideal=True), 0.2)
BODY = cameras(ideal=True).body


def poses(stream):
    """Messages sent to the vehicle, decoded, each with its time."""
    codec = Codec(1, 1)
    return [
        (now, m)
        for now, data in stream.sent
        for m in codec.decode(data)
        if m.get_type() not in ("HEARTBEAT", "TIMESYNC")
    ]


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("body", "found"), [("", True), ("DarkO", True), (1, True), ("Kite", False), (2, False)])
def test_the_body_is_chosen_by_name_or_number(body, found):
    stream = Stream(settings=BridgeSettings(body=body))
    stream.run(0.5)
    assert bool(poses(stream)) == found
    line = "rigid body DarkO (1), 200 Hz" if found else f"no rigid body {body!r} is streamed; there are: DarkO (1)"
    assert stream.bridge.said.count(line) == 1


def test_of_several_bodies_one_must_be_named():
    bridge = PoseBridge(BridgeSettings(), link := NatnetLink(), AutopilotLink(1, Keyring()))
    link.receive(server_info((3, 1), UNICAST), 0.0)
    data = bytearray(frame_packet(FRAMES[0], BODY, (3, 1)))
    at = 4 + data.index(struct.pack("<iii", 0, 1, 1))  # no unlabelled marker, one rigid body, number 1
    two = data[:at] + struct.pack("<i", 2) + data[at + 4 : at + 42] + data[at + 4 : at + 42] + data[at + 42 :]
    assert bridge.from_server(bytes(two), 0.0) == []
    assert "2 rigid bodies are streamed: name one with --body" in bridge.said


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("rate", "sent"), [(math.inf, 200), (100.0, 100), (60.0, 60), (30.0, 30), (10.0, 10)])
def test_no_more_poses_are_sent_than_the_limit(rate, sent):
    stream = Stream(settings=BridgeSettings(rate=rate), dropout=0.0)
    stream.run(1.02)
    assert len(poses(stream)) == pytest.approx(sent, abs=4)


@pytest.mark.parametrize(
    ("message", "kind"), [("odometry", "ODOMETRY"), ("vision", "VISION_POSITION_ESTIMATE"), ("mocap", "ATT_POS_MOCAP")]
)
def test_the_message_is_the_one_that_was_chosen(message, kind):
    stream = Stream(settings=BridgeSettings(message=message))
    stream.run(0.2)
    assert {m.get_type() for _, m in poses(stream)} == {kind}


def test_stamps_tell_the_exposure_through_a_network_that_delays_all():
    stream = Stream(clock="local", settings=BridgeSettings(latency=0.004), network=0.004, delay=0.02, jitter=0.005)
    stream.run(1.2)
    for _, message in poses(stream)[100:]:
        exposed = message.time_usec * 1e-6 - BEGAN
        assert abs(exposed - round(200 * exposed) / 200) < 0.0015


def test_when_tracking_is_lost_it_stops_and_says_so_and_says_when_it_is_back():
    stream = Stream(events=["lost@0.5+0.5"], dropout=0.0)
    stream.run(1.3)
    times = [now - BEGAN for now, _ in poses(stream)]
    assert not [t for t in times if 0.55 < t < 1.0]
    lines = [line for line in stream.bridge.said if "tracking" in line]
    assert lines == ["tracking", "tracking lost: nothing is sent", "tracking"]


def test_swapped_markers_are_held_back_and_it_says_so():
    stream = Stream(events=["swap@0.5+0.5"])
    stream.run(1.3)
    assert not [now for now, _ in poses(stream) if 0.55 < now - BEGAN < 1.0]
    lines = [line for line in stream.said("rigid body") if "Hz" not in line]
    assert [line.split(":")[0] for line in lines] == [
        "the rigid body jumped (markers swapped?)",
        "the rigid body is back",
    ]


def test_the_loss_and_the_return_of_the_server_are_said_once():
    stream = Stream(rate=20.0)
    stream.is_down = True
    stream.run(0.5)
    stream.is_down = False
    stream.run(3.0)
    stream.is_down = True
    stream.run(4.0)
    stream.is_down = False
    stream.server._clients.clear()
    stream.run(2.0)
    lines = [line for line in stream.bridge.said if "frames arrive" in line or "no frames" in line or "waiting" in line]
    assert lines == [
        "waiting for the NatNet server",
        "frames arrive",
        "no frames from the NatNet server: no poses are sent",
        "frames arrive",
    ]
    assert "Motive 2.1, NatNet 3.1, unicast" in stream.bridge.said


def test_every_ten_seconds_it_counts():
    stream = Stream(rate=40.0, dropout=0.1, delay=0.02, jitter=0.0, events=["lost@3+1"])
    stream.run(10.1)
    (line,) = stream.said("frames in")
    assert 300 < int(line.split()[0]) < 400
    for words in ("Hz), ", " sent by the local clock", " missing", " not tracked", "age 20."):
        assert words in line


def test_a_body_that_is_streamed_no_more_is_lost():
    bridge = PoseBridge(BridgeSettings(body=1), link := NatnetLink(), AutopilotLink(1, Keyring()))
    link.receive(server_info((3, 1), UNICAST), 0.0)
    packets = [
        frame_packet(frame, BODY._replace(number=n), (3, 1)) for frame, n in zip(FRAMES, (1, 2, 1), strict=False)
    ]
    sent = [bridge.from_server(data, 0.01 * k) for k, data in enumerate(packets)]
    assert [len(each) for each in sent] == [1, 0, 1]
    assert [Codec(1, 1).decode(each[0])[0].reset_counter for each in sent if each] == [0, 1]
    assert [line for line in bridge.said if "track" in line] == [
        "tracking",
        "tracking lost: nothing is sent",
        "tracking",
    ]


def test_a_jump_that_ends_with_a_loss_is_no_jump_back():
    stream = Stream(events=["swap@0.3+0.5", "lost@0.5+0.2"])
    stream.run(1.2)
    assert not stream.said("jumped back")
    assert poses(stream)[-1][1].reset_counter == 1


def test_what_a_server_or_a_vehicle_calls_itself_controls_no_terminal():
    bridge = PoseBridge(BridgeSettings(), link := NatnetLink(), AutopilotLink(1, Keyring()))
    link.receive(server_info((3, 1), UNICAST), 0.0)
    link.receive(descriptions(BODY._replace(name="\x1b[2J"), (3, 1)), 0.0)
    for k in (0, 20):
        bridge.from_server(frame_packet(FRAMES[k], BODY, (3, 1)), 0.005 * k)
    text = mavlink.MAVLink_statustext_message(4, b"ODOMETRY refused \x1b[31m")
    bridge.from_vehicle(Codec(1, 1).encode(text), 0.0)
    assert "rigid body ?[2J (1), 200 Hz" in bridge.said
    assert "the vehicle says: ODOMETRY refused ?[31m" in bridge.said


def test_frames_that_come_again_or_late_are_not_sent():
    bridge = PoseBridge(BridgeSettings(), link := NatnetLink(), AutopilotLink(1, Keyring()))
    link.receive(server_info((3, 1), UNICAST), 0.0)
    packets = [frame_packet(frame, BODY, (3, 1)) for frame in FRAMES[:4]]
    order = (0, 1, 1, 3, 2)
    assert [len(bridge.from_server(packets[k], 0.01 * n)) for n, k in enumerate(order)] == [1, 1, 0, 1, 0]


def test_a_server_that_begins_anew_is_followed():
    bridge = PoseBridge(BridgeSettings(), link := NatnetLink(), AutopilotLink(1, Keyring()))
    link.receive(server_info((3, 1), UNICAST), 0.0)
    later = FRAMES[0]._replace(number=5000, exposed=10**9, received=10**9, transmitted=10**9)
    assert bridge.from_server(frame_packet(later, BODY, (3, 1)), 100.0)
    assert bridge.from_server(frame_packet(FRAMES[1], BODY, (3, 1)), 101.0)
    assert "the NatNet server's clock was set back: tracking starts again" in bridge.said


@pytest.mark.parametrize(
    ("place", "error"), [((3e38, 0.0, 0.0), 0.0), ((0.0, 0.0, 0.0), 3e38), ((0.0, 2000.0, 0.0), 0.0)]
)
def test_a_body_that_no_hall_can_hold_counts_as_lost(place, error):
    bridge = PoseBridge(BridgeSettings(), link := NatnetLink(), AutopilotLink(1, Keyring()))
    link.receive(server_info((4, 1), UNICAST), 0.0)
    link.receive(descriptions(BODY, (4, 1)), 0.0)
    body = FRAMES[0].body._replace(position=place, marker_error=error)
    assert bridge.from_server(frame_packet(FRAMES[0]._replace(body=body), BODY, (4, 1)), 0.0) == []
    assert bridge.from_server(frame_packet(FRAMES[1], BODY, (4, 1)), 0.005)


@given(st.lists(st.tuples(st.binary(max_size=200), st.integers(0, 300), st.integers(0, 255)), max_size=6))
def test_damaged_and_hostile_packets_send_nothing_wrong_and_raise_nothing(changes):
    bridge = PoseBridge(BridgeSettings(), link := NatnetLink(), AutopilotLink(1, Keyring()))
    link.receive(server_info((4, 1), UNICAST), 0.0)
    link.receive(descriptions(BODY, (4, 1)), 0.0)
    for n, (noise, at, value) in enumerate(changes):
        frame = bytearray(frame_packet(FRAMES[n], BODY, (4, 1)))
        frame[at % len(frame)] = value
        for data in (noise, bytes(frame), bytes(frame[:at])):
            for sent in bridge.from_server(data, 0.005 * n):
                (message,) = Codec(1, 1).decode(sent)
                assert all(map(math.isfinite, (message.x, message.y, message.z, *message.q)))
        bridge.from_vehicle(noise, 0.005 * n)
    bridge.handle_timer(20.0)
