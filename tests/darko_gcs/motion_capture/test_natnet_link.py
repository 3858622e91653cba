"""The client's side of NatNet: connects, stays, and notices when the server is gone and back."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from darko_gcs.motion_capture.bridge_links import NatnetLink
from protocol.natnet import Address, Packet, descriptions, frame_packet, server_info
from tests.support.motion_capture.hall import UNICAST, cameras, frames_of

CAMERAS = cameras(ideal=True)
FRAMES = frames_of(CAMERAS, 0.2)


def kinds(packets):
    return [struct.unpack_from("<H", data)[0] for data in packets]


def met(address=UNICAST, version=(3, 1)):
    link = NatnetLink()
    link.receive(server_info(version, address), 0.0)
    return link


def test_it_asks_for_the_server_each_second_until_it_answers():
    link = NatnetLink()
    assert [kinds(link.requests(now)) for now in (0.0, 0.5, 1.0)] == [[Packet.CONNECT], [], [Packet.CONNECT]]


def test_it_asks_for_the_bodies_at_once_and_keeps_a_stream_of_its_own_alive():
    link = met()
    assert kinds(link.requests(0.0)) == [Packet.CONNECT, Packet.REQUEST_DESCRIPTIONS, Packet.KEEP_ALIVE]
    link.receive(descriptions(CAMERAS.body, (3, 1)), 0.1)
    link.receive(frame_packet(FRAMES[0], CAMERAS.body, (3, 1)), 0.9)
    assert link.names == {"DarkO": 1}
    assert [kinds(link.requests(now)) for now in (0.9, 1.0, 1.5)] == [[], [Packet.KEEP_ALIVE], []]


def test_a_group_is_not_kept_alive():
    assert kinds(met(Address(1511, "239.255.42.99")).requests(0.0)) == [Packet.CONNECT, Packet.REQUEST_DESCRIPTIONS]


def test_without_frames_for_two_seconds_the_server_is_gone_and_is_asked_for_again():
    link = met()
    link.receive(descriptions(CAMERAS.body, (3, 1)), 0.1)
    link.receive(frame_packet(FRAMES[0], CAMERAS.body, (3, 1)), 1.0)
    link.requests(3.0)
    assert link.is_streaming
    assert Packet.CONNECT in kinds(link.requests(3.1))
    assert not link.is_streaming


@pytest.mark.parametrize("version", [(2, 9), (5, 0)])
def test_a_bit_stream_that_cannot_be_read_is_not_read(version):
    info = bytearray(server_info((3, 1), UNICAST))
    info[4 + 260 : 4 + 262] = bytes(version)
    link = NatnetLink()
    link.receive(bytes(info), 0.0)
    assert link.receive(frame_packet(FRAMES[0], CAMERAS.body, (3, 1)), 0.0) is None


def test_damaged_packets_are_counted():
    link = met()
    link.receive(frame_packet(FRAMES[0], CAMERAS.body, (3, 1))[:50], 0.0)
    link.receive(struct.pack("<HH", 1, 0), 0.0)
    assert link.damaged == 2


def test_its_farewell_disconnects():
    assert kinds([met().farewell()]) == [Packet.DISCONNECT]


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
    assert link.receive(frame_packet(FRAMES[0], CAMERAS.body, (4, 1)), 2.0).number == FRAMES[0].number
