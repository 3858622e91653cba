"""Sends a recorded flight to a ground station, frame by frame at its times, as if the vehicle flew now."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

import numpy as np

from darko_gcs.errors import GroundError, LinkError
from darko_gcs.feed.links import OutwardAddress, outward_address
from darko_gcs.feed.replay_output import played_frames
from protocol.tlog import TlogReader
from protocol.tools.option_values import is_loopback

MAX_NAP = 0.05  # between two looks at the clock [s]


def loopback_or_asked(text: str, *, is_network_allowed: bool) -> OutwardAddress:
    """Address to send to.

    Raises:
        LinkError: It is no ``udpout:HOST:PORT``.
        GroundError: It is another machine's, and that was not asked for.
    """
    address = outward_address(text)
    if address is None or address.kind != "udpout":
        raise LinkError(f"{text}: an address to play to is udpout:HOST:PORT")
    if not is_network_allowed and not is_loopback(address.place):
        raise GroundError(
            f"{text}: not this machine: a station there would take the recording for a flight (--network)"
        )
    return address


class LogPlayer(asyncio.DatagramProtocol):
    """Sends the frames, one a datagram, and takes no answers.

    Args:
        reader: The log.
        speed: Playing speed, times real time.
        vehicle: System id of the vehicle whose frames are sent; None: those of all.
        clock: Seconds that never go back.

    Attributes:
        sent: Frames sent.
        answers: Datagrams that came back; nothing heeds them.
        refused: Whether the machine said that nobody listens there.
    """

    def __init__(
        self,
        reader: TlogReader,
        *,
        speed: float = 1.0,
        vehicle: int | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.frames = played_frames(reader, vehicle)
        self._reader, self._speed, self._clock = reader, speed, clock
        self._transport: asyncio.DatagramTransport | None = None
        self.sent, self.answers, self.refused = 0, 0, False

    async def open(self, address: OutwardAddress) -> None:
        """Open a socket to the station.

        Raises:
            LinkError: There is no way to the address.
        """
        loop = asyncio.get_running_loop()
        try:
            self._transport, _ = await loop.create_datagram_endpoint(
                lambda: self, remote_addr=(address.place, address.number)
            )
        except (OSError, UnicodeError) as error:
            raise LinkError(f"cannot send to {address.words}: {getattr(error, 'strerror', None) or error}") from error

    def close(self) -> None:
        """Release the socket."""
        if self._transport is not None:
            self._transport.close()

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:  # noqa: ARG002 - only counted
        """Count what a station asks: a recording answers nothing."""
        self.answers += 1

    def error_received(self, exc: Exception) -> None:
        """Nobody listens there, or not any more: the flight goes on, as a vehicle's would."""
        self.refused = self.refused or isinstance(exc, ConnectionRefusedError)

    async def play(self, begin: float = 0.0) -> None:
        """Send everything from a playing time [s] on, once."""
        first = int(np.searchsorted(self.frames.times, begin))
        started = self._clock()
        while first < len(self.frames.rows):
            reached = begin + (self._clock() - started) * self._speed
            due = int(np.searchsorted(self.frames.times, reached, side="right"))
            for row in self.frames.rows[first:due].tolist():
                self._send(self._reader.frame(row))
            first = max(first, due)
            if first < len(self.frames.rows):
                wait = (float(self.frames.times[first]) - reached) / self._speed
                await asyncio.sleep(min(max(wait, 0.0), MAX_NAP))

    def _send(self, frame: bytes) -> None:
        if self._transport is not None:
            self._transport.sendto(frame)
            self.sent += 1
