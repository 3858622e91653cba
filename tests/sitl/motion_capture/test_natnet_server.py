"""Motive's side of NatNet: who is answered what, who gets frames, and what does not disturb it."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.natnet import Address, Packet, read_frame, read_server
from sitl.motion_capture.natnet_server import CLIENT_TIMEOUT, MAX_CLIENTS, NatnetServer
from tests.support.motion_capture.hall import UNICAST, cameras, frames_of

CAMERAS = cameras(ideal=True)
FRAME = frames_of(CAMERAS, 0.02)[0]
CLIENT, OTHER = ("127.0.0.1", 4000), ("127.0.0.1", 4001)
GROUP = Address(1511, "239.255.42.99")


def ask(kind, text=""):
    data = text.encode() + b"\0" if text else b""
    return struct.pack("<HH", kind, len(data)) + data


def make(address=UNICAST, version=(4, 1)):
    return NatnetServer(CAMERAS.body, version, 200.0, address)


def kind(answers):
    return [struct.unpack_from("<H", data)[0] for data in answers]


@pytest.mark.parametrize("address", [UNICAST, GROUP])
@pytest.mark.parametrize(
    ("asked", "answered"),
    [
        (ask(Packet.CONNECT), [Packet.SERVER_INFO]),
        (ask(Packet.CONNECT, "Ping"), [Packet.SERVER_INFO]),
        (ask(Packet.REQUEST_DESCRIPTIONS), [Packet.DESCRIPTIONS]),
        (ask(Packet.KEEP_ALIVE), []),
        (ask(Packet.DISCONNECT), []),
        (ask(Packet.REQUEST_FRAME), []),
        (ask(Packet.REQUEST, "Nonsense"), [Packet.UNRECOGNIZED]),
        (ask(77), [Packet.UNRECOGNIZED]),
        (b"", []),
        (b"\0\0\0", []),
    ],
)
def test_what_is_asked_is_answered(address, asked, answered):
    assert kind(make(address).receive(asked, CLIENT, 0.0)) == answered


@pytest.mark.parametrize(
    ("words", "answer"),
    [("FrameRate", struct.pack("<f", 200.0)), ("UnitsToMillimeters", struct.pack("<f", 1000.0)),
     ("TimelinePlay", struct.pack("<i", 0)), ("SetPlaybackCurrentFrame,0", struct.pack("<i", 0))],
)  # fmt: skip
def test_requests_that_clients_send_are_answered_with_a_number(words, answer):
    assert make().receive(ask(Packet.REQUEST, words), CLIENT, 0.0) == [struct.pack("<HH", 3, 4) + answer]


def test_the_newest_frame_is_given_on_request():
    server = make()
    server.send(FRAME, 0.0)
    assert kind(server.receive(ask(Packet.REQUEST_FRAME), CLIENT, 0.0)) == [Packet.FRAME]


def test_frames_go_to_those_who_connected_until_they_leave():
    server = make()
    server.receive(ask(Packet.CONNECT), CLIENT, 0.0)
    server.receive(ask(Packet.CONNECT), OTHER, 0.0)
    server.receive(ask(Packet.KEEP_ALIVE), ("127.0.0.1", 4002), 0.0)  # it never connected
    assert [to for to, _ in server.send(FRAME, 0.0)] == [CLIENT, OTHER]
    server.receive(ask(Packet.DISCONNECT), CLIENT, 0.1)
    assert [to for to, _ in server.send(FRAME, 0.1)] == [OTHER]


def test_a_client_that_does_not_keep_alive_is_dropped_and_told():
    server = make()
    for client in (CLIENT, OTHER):
        server.receive(ask(Packet.CONNECT), client, 0.0)
    server.receive(ask(Packet.KEEP_ALIVE), OTHER, 5.0)
    server.receive(ask(Packet.REQUEST_DESCRIPTIONS), CLIENT, 5.0)  # that does not count
    sent = server.send(FRAME, CLIENT_TIMEOUT)
    assert [(to, *kind([data])) for to, data in sent] == [(CLIENT, Packet.TIMED_OUT), (OTHER, Packet.FRAME)]
    assert server.clients == (OTHER,)


def test_with_a_group_frames_go_there_alone():
    server = make(GROUP)
    assert read_server(server.receive(ask(Packet.CONNECT), CLIENT, 0.0)[0]).group == "239.255.42.99"
    assert [to for to, _ in server.send(FRAME, 0.0)] == [None]


@pytest.mark.parametrize(
    ("words", "code"), [("3.1", 0), ("3", 0), ("4.1.0.0", 0), ("2.9", 1), ("5.0", 1), ("x", 1), ("", 1)]
)
def test_a_client_changes_the_bit_stream_of_its_own(words, code):
    server = make()
    for client in (CLIENT, OTHER):
        server.receive(ask(Packet.CONNECT), client, 0.0)
    assert server.receive(ask(Packet.REQUEST, f"Bitstream,{words}"), CLIENT, 0.0)[0][4:] == struct.pack("<i", code)
    sizes = {to: len(data) for to, data in server.send(FRAME, 0.0)}
    assert (sizes[CLIENT] == sizes[OTHER]) == (code == 1 or words.startswith("4.1"))


def test_a_group_has_one_bit_stream_for_all():
    server = make(GROUP)
    server.receive(ask(Packet.CONNECT), CLIENT, 0.0)
    assert server.receive(ask(Packet.REQUEST, "Bitstream,3.1"), CLIENT, 0.0)[0][4:] == struct.pack("<i", 1)


def test_a_flood_of_clients_displaces_nobody():
    server = make()
    for port in range(10 * MAX_CLIENTS):
        server.receive(ask(Packet.CONNECT), ("127.0.0.1", port), 0.0)
    assert [port for _, port in server.clients] == list(range(MAX_CLIENTS))


@given(st.lists(st.binary(max_size=300), max_size=5))
def test_no_packet_raises_and_frames_go_on(packets):
    server = make()
    server.receive(ask(Packet.CONNECT), CLIENT, 0.0)
    for data in packets:
        server.receive(data, OTHER, 0.0)
    frame = dict(server.send(FRAME, 0.0))[CLIENT]
    assert read_frame(frame, (4, 1), 1).number == FRAME.number


@given(st.integers(0, 12), st.binary(max_size=100))
def test_no_payload_raises(number, data):
    make().receive(struct.pack("<HH", number, len(data)) + data, CLIENT, 0.0)
