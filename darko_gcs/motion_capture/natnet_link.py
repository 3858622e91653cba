"""The client's side of NatNet, without a socket: connects, stays connected, and notices when the server is gone."""

from __future__ import annotations

import math

from protocol.natnet import (
    FrameReading,
    Packet,
    ServerReading,
    is_readable,
    packet_kind,
    read_body_names,
    read_frame,
    read_server,
    request,
)

ASKING_PERIOD = 1.0  # for the server or for what it describes [s]
KEEP_ALIVE_PERIOD = 1.0  # [s]
STREAM_SILENT_TIME = 2.0  # without a frame the server is gone [s]


class NatnetLink:
    """One server. Hand in what arrives, send what ``requests`` gives.

    ``server`` is who answered, ``names`` the rigid bodies that it describes; None until they are known.
    """

    def __init__(self) -> None:
        self.server: ServerReading | None = None
        self.names: dict[str, int] | None = None
        self.damaged = 0  # packets that could not be read
        self._asked = self._kept = self._heard = -math.inf
        self.is_streaming = self._has_all_names = False

    def receive(self, data: bytes, now: float) -> FrameReading | None:
        """Take a packet of either socket; gives the frame if it is one.

        Args:
            data: The packet.
            now: Monotonic time [s].
        """
        kind = packet_kind(data)
        if kind == Packet.SERVER_INFO:
            self._meet(data)
            return None
        if self.server is None or not is_readable(self.server.version):
            return None
        if kind == Packet.FRAME:
            return self._take_frame(data, now)
        names = read_body_names(data, self.server.version)
        if names is not None:
            self.names, self._has_all_names = names, True
        return None

    def requests(self, now: float) -> list[bytes]:
        """Requests to send to the command socket now."""
        if now - self._heard > STREAM_SILENT_TIME:
            self.is_streaming = False
        wanted = []
        if now - self._asked >= ASKING_PERIOD and not (self.is_streaming and self._has_all_names):
            self._asked = now
            wanted.append(request(Packet.CONNECT, "Ping"))
            if self.server is not None:
                wanted.append(request(Packet.REQUEST_DESCRIPTIONS))
        if self.server is not None and not self.server.group and now - self._kept >= KEEP_ALIVE_PERIOD:
            self._kept = now
            wanted.append(request(Packet.KEEP_ALIVE))
        return wanted

    def farewell(self) -> bytes:
        """Request that ends the connection."""
        return request(Packet.DISCONNECT)

    def _meet(self, data: bytes) -> None:
        server = read_server(data)
        if server is None:
            self.damaged += 1
            return
        if self.server is None or server.version != self.server.version:
            self._asked = -math.inf  # what it describes is wanted at once
        self.server = server

    def _take_frame(self, data: bytes, now: float) -> FrameReading | None:
        server = self.server
        if server is None:
            return None
        frame = read_frame(data, server.version, server.clock)
        if frame is None:
            self.damaged += 1
            return None
        self._heard, self.is_streaming = now, True
        self._has_all_names &= not frame.models_changed
        return frame
