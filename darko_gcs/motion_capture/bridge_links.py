"""The bridge's two ends, without a socket: the client's side of NatNet, and MAVLink to the autopilot.

Three ways to stamp. PX4 asks for our time and shifts our stamps to its own clock: they stay in ours. DarkO answers
TIMESYNC and takes stamps of its own clock: so we ask, and shift them. And where the server's clock is the vehicle's
time since boot, as that of the simulated Motive is, the server's stamps are right as they are, however fast or late
both run.
https://mavlink.io/en/services/timesync.html
"""

from __future__ import annotations

import math
import re
from collections import deque

from protocol.dialect import mavlink
from protocol.engines.heartbeat import HEARTBEAT_PERIOD
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
from protocol.wire.codec import Codec
from protocol.wire.message import Message, source_of
from protocol.wire.signing import Keyring

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


CLOCKS = ("auto", "local", "vehicle", "server")
COMPONENT = mavlink.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY
SYNC_PERIOD = 0.25  # [s]
SYNC_SAMPLES = 16  # of which the one with the shortest way counts
MAX_SYNC_STEP = 0.1  # of the other clock; more is a restart [s]
MAX_ROUND_TRIP = 0.5  # [s]
SAME_CLOCK = 1.0  # two clocks that differ by less may be one [s]
SAME_STAMPS = 50  # that agree so before they are taken to be
SILENT_TIME = 3.0  # without a HEARTBEAT the vehicle is gone [s]
MAX_KNOWN_TEXTS = 32  # of the vehicle's refusals, each told once until the vehicle is gone


class AutopilotLink:
    """One vehicle.

    Args:
        system: System id of the vehicle, which is ours, too.
        keyring: Signs what is sent; with a key only signed messages are heard.
        clock: Of our stamps, one of :data:`CLOCKS`; auto is ours if the vehicle asks for it, else the server's if that
            is the vehicle's time since boot, else the vehicle's.
    """

    def __init__(self, system: int, keyring: Keyring, clock: str = "auto") -> None:
        self._codec, self._keyring, self._clock = Codec(system, COMPONENT, keyring.link(None)), keyring, clock
        self._system = system
        self._beat = self._synced = -math.inf
        self.heard = -math.inf  # the vehicle's last HEARTBEAT [s]
        self.autopilot = ""
        self._asks = False  # the vehicle compares clocks itself
        self._booted = -math.inf  # the vehicle's newest time since boot [s]
        self._agreed = 0  # stamps of the server in a row that are of it
        self._offsets: deque[tuple[float, float]] = deque(maxlen=SYNC_SAMPLES)  # round trip and offset [s]
        self._told: set[str] = set()
        self._answers: list[bytes] = []

    def is_heard(self, now: float) -> bool:
        """Whether the vehicle is there."""
        return now - self.heard < SILENT_TIME

    @property
    def clock(self) -> str:
        """Name of the clock that stamps come from now."""
        if self._clock == "server" or (self._clock == "auto" and not self._asks and self._agreed >= SAME_STAMPS):
            return "server"
        wants_theirs = self._clock == "vehicle" or (self._clock == "auto" and not self._asks)
        return "vehicle" if wants_theirs and self._offsets else "local"

    def compare(self, stamp: float) -> None:
        """Take a stamp that the server has just made [s]: whether it is of the vehicle's time since boot."""
        self._agreed = self._agreed + 1 if abs(stamp - self._booted) < SAME_CLOCK else 0

    def stamp(self, time: float, of_server: float | None = None) -> int:
        """An instant as poses tell it [us].

        Args:
            time: On our clock [s].
            of_server: On the server's [s]; None: it is not told.
        """
        clock = self.clock
        if clock == "server" and of_server is not None:
            return max(round(1e6 * of_server), 1)
        shift = min(self._offsets)[1] if clock == "vehicle" else 0.0
        return max(round(1e6 * (time + shift)), 1)

    def encode(self, message: Message, now: float) -> bytes:
        """A message to send."""
        self._keyring.advance_time(now)
        return self._codec.encode(message)

    def receive(self, data: bytes, now: float) -> list[str]:
        """Take a datagram; gives what the vehicle says about poses, for a person."""
        self._keyring.advance_time(now)
        said = []
        for message in self._codec.decode(data):
            if source_of(message) != (self._system, mavlink.MAV_COMP_ID_AUTOPILOT1):
                continue
            if self._keyring.is_on and not message.get_signed():
                continue
            kind = message.get_type()
            self._booted = 1e-3 * getattr(message, "time_boot_ms", 1e3 * self._booted)
            if kind == "HEARTBEAT":
                self._hear(message, now)
            elif kind == "TIMESYNC":
                self._sync(message, now)
            elif kind == "STATUSTEXT" and "refused" in message.text and self._is_new(message.text):
                said.append(message.text)
        return said

    def outgoing(self, now: float) -> list[bytes]:
        """Answers, heartbeats and requests that are due."""
        sent, self._answers = self._answers, []
        if now - self._beat >= HEARTBEAT_PERIOD:
            self._beat = now
            beat = (mavlink.MAV_TYPE_GENERIC, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3)
            sent.append(self.encode(mavlink.MAVLink_heartbeat_message(*beat), now))
        if now - self._synced >= SYNC_PERIOD:
            self._synced = now
            sent.append(self.encode(mavlink.MAVLink_timesync_message(tc1=0, ts1=round(1e9 * now)), now))
        return sent

    def _hear(self, message: Message, now: float) -> None:
        if not self.is_heard(now):
            self._told.clear()
            self._offsets.clear()
        known = mavlink.enums["MAV_AUTOPILOT"].get(message.autopilot)
        self.autopilot = str(known.name).removeprefix("MAV_AUTOPILOT_") if known else "autopilot"
        self.heard = now

    def _sync(self, message: Message, now: float) -> None:
        if message.tc1 == 0:
            self._asks = True
            answer = mavlink.MAVLink_timesync_message(tc1=round(1e9 * now), ts1=message.ts1)
            self._answers.append(self.encode(answer, now))
            return
        asked = 1e-9 * message.ts1
        if not 0.0 <= now - asked < MAX_ROUND_TRIP:
            return  # not ours, or too late to tell anything
        offset = 1e-9 * message.tc1 - (asked + now) / 2.0
        if self._offsets and abs(offset - min(self._offsets)[1]) > MAX_SYNC_STEP:
            self._offsets.clear()
        self._offsets.append((now - asked, offset))

    def _is_new(self, text: str) -> bool:
        kind = re.sub(r"\d+", "", text)  # how late a pose was is not news
        if kind in self._told or len(self._told) >= MAX_KNOWN_TEXTS:
            return False
        self._told.add(kind)
        return True
