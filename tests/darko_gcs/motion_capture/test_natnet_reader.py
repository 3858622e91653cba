"""Packets of a NatNet server: whole ones are read, damaged and hostile ones are none, at once."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from natnet import Version

from darko_gcs.motion_capture.natnet_link import NatnetLink
from darko_gcs.motion_capture.natnet_reader import FRAME, read_body_names, read_frame, read_server, request
from sitl.motion_capture.natnet_packets import (
    BIT_STREAMS,
    Address,
    Packet,
    descriptions,
    frame_packet,
    packet,
    server_info,
)
from tests.support.motion_capture.hall import cameras, frames_of

CAMERAS = cameras(ideal=True, delay=0.02)
CAPTURED = frames_of(CAMERAS, 0.1)[-1]
CLOCK = 10_000_000
WHOLE = {version: frame_packet(CAPTURED, CAMERAS.body, version) for version in BIT_STREAMS}
VERSIONS = st.sampled_from(BIT_STREAMS)
HUGE = b"\xff\xff\xff\x7f"


@pytest.mark.parametrize("version", BIT_STREAMS, ids=str)
def test_a_frame_has_the_body_and_its_times(version):
    frame = read_frame(WHOLE[version], Version(*version), CLOCK)
    (body,) = frame.bodies
    x, y, z, w = CAPTURED.body.attitude
    assert body.position == pytest.approx(CAPTURED.body.position)
    assert body.attitude == pytest.approx((w, x, y, z), abs=1e-6)
    assert body.is_tracked
    assert frame.transmitted - frame.exposed == pytest.approx(0.02)
    assert frame.number == CAPTURED.number


def test_without_a_clock_a_frame_has_no_times():
    frame = read_frame(WHOLE[3, 1], Version(3, 1), 0)
    assert (frame.exposed, frame.transmitted) == (None, None)


@pytest.mark.parametrize("version", BIT_STREAMS, ids=str)
def test_bodies_are_known_by_name(version):
    assert read_body_names(descriptions(CAMERAS.body, version), Version(*version)) == {"DarkO": 1}


def test_the_server_is_known_with_and_without_its_later_fields():
    data = server_info((4, 1), Address(1511, "239.255.42.99"))
    server = read_server(data)
    assert (server.name, server.application, str(server.version)) == ("Motive", "3.1", "4.1")
    assert (server.clock, server.data_port, server.group) == (CLOCK, 1511, "239.255.42.99")
    assert read_server(data[: 4 + 264])[3:] == (0, 0, "")
    assert read_server(data[:200]) is None


@given(VERSIONS, st.data())
def test_a_frame_that_is_cut_off_is_none_unless_only_its_end_is_missing(version, data):
    whole = WHOLE[version]
    cut = data.draw(st.integers(0, len(whole) - (13 if version >= (4, 1) else 5)))
    assert read_frame(whole[:cut], Version(*version), CLOCK) is None


@given(VERSIONS, st.data())
def test_a_frame_with_bytes_changed_raises_nothing(version, data):
    damaged = bytearray(WHOLE[version])
    for _ in range(data.draw(st.integers(1, 8))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    frame = read_frame(bytes(damaged), Version(*version), CLOCK)
    assert frame is None or all(abs(x) < 1e5 for body in frame.bodies for x in body.position)


@given(VERSIONS, st.integers(0, 120), st.sampled_from([5, 7]))
def test_a_packet_that_claims_more_than_it_holds_gives_no_more_than_is_there(version, at, kind):
    whole = WHOLE[version] if kind == FRAME else descriptions(CAMERAS.body, version)
    at = min(4 + 4 * (at // 4), len(whole) - 4)
    hostile = whole[:at] + HUGE + whole[at + 4 :]
    frame, names = read_frame(hostile, Version(*version), CLOCK), read_body_names(hostile, Version(*version))
    if kind == FRAME:
        assert names is None
        assert frame is None or (len(frame.bodies) <= 1 and all(abs(x) < 1e5 for b in frame.bodies for x in b.position))
    else:
        assert frame is None
        assert names is None or len(names) <= 1


@pytest.mark.parametrize("version", BIT_STREAMS, ids=str)
def test_a_packet_of_countless_parts_is_none_at_once(version):
    frame, names = WHOLE[version], descriptions(CAMERAS.body, version)
    assert read_frame(frame[:8] + HUGE + frame[12:], Version(*version), CLOCK) is None
    assert read_body_names(names[:4] + HUGE + names[8:], Version(*version)) is None


def test_counts_beyond_the_packet_and_texts_without_an_end_are_none():
    hostile = [packet(Packet.DESCRIPTIONS, struct.pack("<ii", 1, 0) + b"name"),
               packet(Packet.DESCRIPTIONS, struct.pack("<ii", 1, 0) + b"n\0" + HUGE + 100 * b"\0"),
               packet(Packet.DESCRIPTIONS, struct.pack("<ii", 1, 3) + 4 * b"\0" + b"plate\0" + 8 * b"\0")]  # fmt: skip
    assert [read_body_names(data, Version(3, 1)) for data in hostile] == [None] * 3


@given(st.lists(st.binary(max_size=400), max_size=6))
def test_nothing_disturbs_the_link(packets):
    link = NatnetLink()
    link.receive(server_info((4, 1), Address(1511)), 0.0)
    for data in packets:
        link.receive(data, 0.0)
        for kind in (1, 5, 7):
            link.receive(struct.pack("<HH", kind, len(data)) + data, 0.0)
    link.receive(server_info((4, 1), Address(1511)), 1.0)
    link.requests(2.0)
    assert link.receive(WHOLE[4, 1], 2.0).number == CAPTURED.number


def test_a_body_that_is_not_of_numbers_is_left_out():
    nan = CAPTURED._replace(body=CAPTURED.body._replace(position=(float("nan"), 0.0, 0.0)))
    zero = CAPTURED._replace(body=CAPTURED.body._replace(attitude=(0.0, 0.0, 0.0, 0.0)))
    never = zero._replace(body=zero.body._replace(is_tracked=False))
    read = [read_frame(frame_packet(f, CAMERAS.body, (3, 1)), Version(3, 1), CLOCK).bodies for f in (nan, zero, never)]
    assert [len(bodies) for bodies in read] == [0, 0, 1]


def test_a_request_has_its_size_and_an_end():
    assert request(0, "Ping") == struct.pack("<HH", 0, 5) + b"Ping\0"
