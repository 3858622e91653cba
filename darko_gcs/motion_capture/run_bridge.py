"""Runs a bridge of the options of ``darko-gcs bridge``: sockets and a clock around it."""

from __future__ import annotations

import argparse
import select
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, suppress
from typing import NamedTuple

from darko_gcs.errors import LinkError
from darko_gcs.motion_capture.bridge_links import AutopilotLink, NatnetLink
from darko_gcs.motion_capture.pose_bridge import BridgeSettings, PoseBridge
from darko_gcs.motion_capture.poses import AXES_OF_LABS, ESTIMATORS, HALL_SIDES, AxesSettings, PoseAccuracy
from darko_gcs.station.keyring_setup import open_keyring
from protocol.natnet import MAX_PACKET
from protocol.tools.option_values import VEHICLE_PORT, is_loopback

Address = tuple[str, int]
MAX_WAIT = 0.05  # [s]
MAX_PACKETS = 64  # packets of one socket before the others are looked at: a flood stops nothing
MAX_REPLY = 2048  # of the vehicle [bytes]


class BridgeAddresses(NamedTuple):
    """Network addresses of the server, the vehicle and the bridge."""

    server: str = "127.0.0.1"
    command_port: int = 1510
    interface: str = "127.0.0.1"  # local address towards the server
    vehicle: Address = ("127.0.0.1", VEHICLE_PORT)


class BridgeSockets:
    """A running bridge. The group that the server tells is joined when it is known.

    Args:
        bridge: Makes poses of packets.
        natnet: The server's side of it.
        autopilot: The vehicle's side of it.
        addresses: Where everybody is.
        stack: Closes the sockets.

    Raises:
        LinkError: A socket cannot be opened.
    """

    def __init__(
        self, bridge: PoseBridge, natnet: NatnetLink, autopilot: AutopilotLink, addresses: BridgeAddresses,
        stack: ExitStack,
    ) -> None:  # fmt: skip
        self._bridge, self._natnet, self._autopilot, self._addresses = bridge, natnet, autopilot, addresses
        self._stack = stack
        self._command = self._opened((addresses.interface, 0))
        self._vehicle = self._opened(("127.0.0.1" if is_loopback(addresses.vehicle) else "", 0))
        self._data: socket.socket | None = None
        self._group = ("", 0)

    def run(self, say: Callable[[str], None]) -> None:
        """Bridge until it is interrupted."""
        try:
            while True:
                self.step(time.monotonic())
                for line in self.take_lines():
                    say(line)
                sockets = [s for s in (self._command, self._vehicle, self._data) if s is not None]
                select.select(sockets, [], [], MAX_WAIT)
        finally:
            self._send(self._command, self._natnet.farewell(), self._server)

    def step(self, now: float) -> None:
        """Take and send what there is.

        Args:
            now: Monotonic time [s].
        """
        for source in (self._data, self._command):
            for data, sender in _received(source, MAX_PACKET):
                if sender[0] == self._addresses.server:
                    for message in self._bridge.from_server(data, now):
                        self._send(self._vehicle, message, self._addresses.vehicle)
        for data, sender in _received(self._vehicle, MAX_REPLY):
            if sender == self._addresses.vehicle:
                self._bridge.from_vehicle(data, now)
        self._join()
        for data in self._natnet.requests(now):
            self._send(self._command, data, self._server)
        for data in self._autopilot.outgoing(now):
            self._send(self._vehicle, data, self._addresses.vehicle)
        self._bridge.handle_timer(now)

    def take_lines(self) -> list[str]:
        """Lines said since the last call."""
        lines, self._bridge.said = self._bridge.said, []
        return lines

    @property
    def _server(self) -> Address:
        return self._addresses.server, self._addresses.command_port

    def _join(self) -> None:
        """Listen to the group that the server tells."""
        server = self._natnet.server
        if server is None or not server.group or (server.group, server.data_port) == self._group:
            return
        if self._data is not None:
            self._data.close()
        self._data, self._group = None, (server.group, server.data_port)
        try:
            opened = self._opened(self._group)
            member = socket.inet_aton(server.group) + socket.inet_aton(self._addresses.interface)
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        except (LinkError, OSError) as error:  # the server may be set right
            reason = getattr(error, "strerror", None) or str(error)
            self._bridge.said.append(f"cannot join {server.group} on {self._addresses.interface}: {reason}")
            return
        self._data = opened

    def _opened(self, address: Address) -> socket.socket:
        made = self._stack.enter_context(closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)))
        made.setblocking(False)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            made.bind(address)
        except OSError as error:
            raise LinkError(f"cannot listen on {address[0] or 'any address'}:{address[1]}: {error.strerror}") from error
        return made

    def _send(self, through: socket.socket, data: bytes, to: Address) -> None:
        with suppress(OSError):  # nobody there, or a full buffer: a loss, not an error
            through.sendto(data, to)


def _received(source: socket.socket | None, size: int) -> Iterator[tuple[bytes, Address]]:
    for _ in range(MAX_PACKETS if source is not None else 0):
        try:
            yield source.recvfrom(size)  # type: ignore[union-attr]
        except (BlockingIOError, InterruptedError):
            return
        except OSError:  # nobody listens where the last datagram went
            continue


def axes_settings(args: argparse.Namespace) -> AxesSettings:
    """Axes of the lab that the options name, with the axes that they give changed."""
    lab = AXES_OF_LABS[args.lab]
    angle = lab.x_angle if args.x_angle is None else args.x_angle
    return AxesSettings(
        up_axis=args.up_axis or lab.up_axis,
        long_edge=args.long_edge or lab.long_edge,
        x_angle=angle if args.x_side is None else HALL_SIDES[args.x_side],
        nose=args.nose or lab.nose,
    )


def run_bridge(args: argparse.Namespace, say: Callable[[str], None]) -> None:
    """Bridge until it is interrupted.

    Args:
        args: Options of ``darko-gcs bridge``.
        say: Tells a person what happens.

    Raises:
        GroundError: The key or a port is not usable.
    """
    settings = BridgeSettings(
        axes=axes_settings(args),
        body=args.body,
        message=args.message,
        rate=args.rate,
        latency=args.latency,
        accuracy=PoseAccuracy(args.deviation, args.attitude_deviation, ESTIMATORS[args.estimator]),
    )
    natnet, autopilot = NatnetLink(), AutopilotLink(args.system, open_keyring(args.signing_key), args.clock)
    addresses = BridgeAddresses(args.server, args.command_port, args.interface, args.to)
    axes = settings.axes
    say(
        f"NatNet at {args.server}:{args.command_port} -> {args.message.upper()} to {args.to[0]}:{args.to[1]}; "
        f"{axes.up_axis} up, long edge {axes.long_edge}, east at {axes.x_angle:g} deg from the right, nose {axes.nose}"
    )
    with ExitStack() as stack:
        BridgeSockets(PoseBridge(settings, natnet, autopilot), natnet, autopilot, addresses, stack).run(say)
