"""Motive's side of NatNet, without a socket: answers clients, and says which packet of a frame goes where.

Without a multicast group frames go to where a CONNECT came from, whatever port of data is told, as Motive sends them.
"""

from __future__ import annotations

import re
from collections.abc import Hashable
from dataclasses import dataclass

from protocol.natnet import (
    BIT_STREAMS,
    Address,
    BitStream,
    CaptureFrame,
    Packet,
    descriptions,
    frame_packet,
    packet,
    read_packet,
    read_request,
    response,
    server_info,
)
from sitl.motion_capture.rigid_body import RigidBody

CLIENT_TIMEOUT = 10.0  # without a KEEP_ALIVE a client of its own stream is dropped, as Motive does [s]
MAX_CLIENTS = 16  # one more is not served: a flood displaces nobody
MILLIMETRES = 1000.0  # in a unit of the stream
DONE, FAILED = 0, 1  # codes of a RESPONSE
PLAYBACK = frozenset({"TimelinePlay", "TimelineStop", "SetPlaybackCurrentFrame", "LiveMode", "SubscribeToData"})
_VERSION = re.compile(r"(\d)(?:\.(\d))?(?:\.\d+)*")

Sent = tuple[Hashable | None, bytes]  # to whom; None: the multicast group


@dataclass(slots=True)
class _Client:
    """A client that gets frames of its own, and its bit-stream version."""

    heard: float  # [s]
    version: BitStream


class NatnetServer:
    """Serves one rigid body.

    Args:
        body: As it was made.
        version: Bit-stream, of :data:`BIT_STREAMS`.
        rate: Frames a second.
        address: Where frames go.
    """

    def __init__(self, body: RigidBody, version: BitStream, rate: float, address: Address) -> None:
        self._body, self._version, self._rate, self._address = body, version, rate, address
        self._clients: dict[Hashable, _Client] = {}
        self._newest: CaptureFrame | None = None

    @property
    def clients(self) -> tuple[Hashable, ...]:
        """Addresses of the clients that get frames of their own."""
        return tuple(self._clients)

    def receive(self, data: bytes, client: Hashable, now: float) -> list[bytes]:
        """Take a datagram of the command socket; gives the answers to it.

        Args:
            data: The datagram.
            client: Its sender.
            now: Monotonic time [s].
        """
        read = read_packet(data)
        if read is None:
            return []
        kind, payload = read
        version = self._version_of(client)
        match kind:
            case Packet.CONNECT:
                self._admit(client, now)
                return [server_info(self._version_of(client), self._address)]
            case Packet.KEEP_ALIVE:
                if client in self._clients:  # nothing else keeps a client
                    self._clients[client].heard = now
                return []
            case Packet.DISCONNECT:
                self._clients.pop(client, None)
                return []
            case Packet.REQUEST_DESCRIPTIONS:
                return [descriptions(self._body, version)]
            case Packet.REQUEST_FRAME:
                return [] if self._newest is None else [frame_packet(self._newest, self._body, version)]
            case Packet.REQUEST:
                return [self._answer(read_request(payload), client)]
        return [packet(Packet.UNRECOGNIZED)]

    def send(self, frame: CaptureFrame, now: float) -> list[Sent]:
        """Packets of a frame: one for the group, or one for each client that is still there."""
        self._newest = frame
        if self._address.group:
            return [(None, frame_packet(frame, self._body, self._version))]
        silent = [key for key, client in self._clients.items() if now - client.heard >= CLIENT_TIMEOUT]
        for key in silent:
            del self._clients[key]
        packets = {version: frame_packet(frame, self._body, version) for version in self._versions_in_use()}
        farewells: list[Sent] = [(key, packet(Packet.TIMED_OUT)) for key in silent]
        return farewells + [(key, packets[client.version]) for key, client in self._clients.items()]

    def _versions_in_use(self) -> set[BitStream]:
        return {client.version for client in self._clients.values()}

    def _version_of(self, client: Hashable) -> BitStream:
        known = self._clients.get(client)
        return self._version if known is None else known.version

    def _admit(self, client: Hashable, now: float) -> None:
        if not self._address.group and client not in self._clients and len(self._clients) < MAX_CLIENTS:
            self._clients[client] = _Client(now, self._version)

    def _answer(self, words: str, client: Hashable) -> bytes:
        """The answer to a REQUEST."""
        command, _, argument = words.partition(",")
        if command == "Bitstream":
            return response(self._change_version(argument, client))
        if command == "FrameRate":
            return response(float(self._rate))
        if command == "UnitsToMillimeters":
            return response(MILLIMETRES)
        return response(DONE) if command in PLAYBACK else packet(Packet.UNRECOGNIZED)

    def _change_version(self, text: str, client: Hashable) -> int:
        """Give a client another bit-stream. A group has one for all."""
        written = _VERSION.fullmatch(text.strip())
        version = (int(written[1]), int(written[2] or 0)) if written else None
        if version not in BIT_STREAMS or client not in self._clients:
            return FAILED
        self._clients[client].version = version
        return DONE
