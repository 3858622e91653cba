"""Runs a bridge of the options of ``darko-gcs bridge``: sockets and a clock around it."""

import socket
import time
from contextlib import ExitStack, closing

import pytest

from darko_gcs.errors import LinkError
from darko_gcs.motion_capture.bridge_links import AutopilotLink, NatnetLink
from darko_gcs.motion_capture.pose_bridge import BridgeSettings, PoseBridge
from darko_gcs.motion_capture.run_bridge import BridgeAddresses, BridgeSockets
from protocol.natnet import Address, frame_packet, server_info
from protocol.wire.codec import Codec
from protocol.wire.signing import Keyring
from sitl.motion_capture.motive_process import _group_socket
from sitl.motion_capture.natnet_server import NatnetServer
from tests.support.motion_capture.hall import cameras, frames_of

CAMERAS = cameras(ideal=True)
FRAMES = frames_of(CAMERAS, 0.2)
GROUP = "239.255.42.99"


@pytest.fixture
def stack():
    with ExitStack() as stack:
        yield stack


def udp(stack):
    made = stack.enter_context(closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)))
    made.bind(("127.0.0.1", 0))
    made.settimeout(0.02)
    return made, made.getsockname()[1]


def taken(one):
    """Datagrams that wait in a socket."""
    while True:
        try:
            yield one.recvfrom(65535)
        except TimeoutError:
            return


def bridge_to(stack, command_port, vehicle_port):
    natnet, autopilot = NatnetLink(), AutopilotLink(1, Keyring())
    addresses = BridgeAddresses(command_port=command_port, vehicle=("127.0.0.1", vehicle_port))
    return BridgeSockets(PoseBridge(BridgeSettings(), natnet, autopilot), natnet, autopilot, addresses, stack)


@pytest.mark.parametrize("group", ["", GROUP])
def test_frames_go_through_to_the_vehicle(stack, group):
    command, command_port = udp(stack)
    vehicle, vehicle_port = udp(stack)
    _, data_port = udp(stack)  # a free one: the group's socket shares it
    sender = stack.enter_context(closing(_group_socket("127.0.0.1")))
    server = NatnetServer(CAMERAS.body, (3, 1), 200.0, Address(data_port, group))
    bridge, heard = bridge_to(stack, command_port, vehicle_port), []
    for n, frame in enumerate(FRAMES[:20]):
        bridge.step(100.0 + n)
        for data, client in taken(command):
            for answer in server.receive(data, client, 0.0):
                command.sendto(answer, client)
        for to, data in server.send(frame, 0.0):
            (sender if to is None else command).sendto(data, to or (group, data_port))
        bridge.step(100.1 + n)
        heard += [m.get_type() for data, _ in taken(vehicle) for m in Codec(1, 1).decode(data)]
        if "ODOMETRY" in heard:
            break
    assert "ODOMETRY" in heard
    lines = bridge.take_lines()
    assert "frames arrive" in lines
    assert bridge.take_lines() == []


def test_frames_of_another_address_are_not_heard(stack):
    _, vehicle_port = udp(stack)
    natnet, autopilot = NatnetLink(), AutopilotLink(1, Keyring())
    addresses = BridgeAddresses(server="127.0.0.2", vehicle=("127.0.0.1", vehicle_port))
    bridge = BridgeSockets(PoseBridge(BridgeSettings(), natnet, autopilot), natnet, autopilot, addresses, stack)
    forger, _ = udp(stack)
    forger.sendto(frame_packet(FRAMES[0], CAMERAS.body, (3, 1)), bridge._command.getsockname())
    bridge.step(time.monotonic())
    assert natnet.damaged == 0
    assert not natnet.is_streaming


@pytest.mark.parametrize("group", ["10.0.0.1", "255.255.255.255", "127.0.0.1"])
def test_a_group_that_cannot_be_joined_is_said_and_does_not_end_the_bridge(stack, group):
    command, command_port = udp(stack)
    bridge = bridge_to(stack, command_port, 9)
    command.sendto(server_info((3, 1), Address(1, group)), bridge._command.getsockname())
    bridge.step(time.monotonic())
    bridge.step(time.monotonic())
    assert [line for line in bridge.take_lines() if f"cannot join {group} on 127.0.0.1" in line]


def test_an_interface_that_is_not_there_is_one_clear_error(stack):
    natnet, autopilot = NatnetLink(), AutopilotLink(1, Keyring())
    addresses = BridgeAddresses(interface="203.0.113.1")
    with pytest.raises(LinkError, match=r"cannot listen on 203\.0\.113\.1:0"):
        BridgeSockets(PoseBridge(BridgeSettings(), natnet, autopilot), natnet, autopilot, addresses, stack)
