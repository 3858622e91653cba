"""UDP socket and clock of a station: moves bytes, decides nothing."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Sequence

from darko_gcs.errors import LinkError
from darko_gcs.feed.udp_socket import Address, Datagram, UdpSocket
from darko_gcs.station.station import Station
from protocol.tools.option_values import is_loopback
from protocol.wire.signing import is_secret

TIMER_PERIOD = 0.02  # [s]


class UdpLink:
    """Connects a station to the network until it is closed."""

    def __init__(self, station: Station) -> None:
        self.station = station
        self.port = 0  # local, once it is open
        self._peer: Address | None = None
        self._judged: Address | None = None  # the address that is known to be private or not
        self._socket: UdpSocket | None = None
        self._timer: asyncio.Task[None] | None = None
        self._epoch = time.time_ns() // 1000 - time.monotonic_ns() // 1000  # of the monotonic clock, since 1970 [us]

    async def open(self, host: str, port: int) -> None:
        """Listen for the vehicle; with port 0, on any free port.

        Raises:
            LinkError: If the port is not available.
        """
        try:
            self._socket = await UdpSocket.bind(host, port, self.take_datagrams)
        except (OSError, UnicodeError) as error:  # UnicodeError: the text cannot be a host name
            reason = getattr(error, "strerror", None) or "not a host name"
            raise LinkError(f"cannot listen on {host[:64]}:{port}: {reason}") from error
        self._timer = asyncio.create_task(self._run_timer())
        self.port = self._socket.address[1]

    async def close(self) -> None:
        """Release the port and close the recording."""
        if self._timer is not None:
            self._timer.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._timer
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        self.station.close()

    @property
    def words(self) -> str:
        """State of the link, in words."""
        host, port = ("", self.port) if self._socket is None else self._socket.address
        return f"Listening on {host}:{port}"

    @property
    def now(self) -> float:
        """The station's clock [s]."""
        return time.monotonic()

    def take_datagrams(self, datagrams: Sequence[Datagram]) -> None:
        """Take datagrams. Answers go to the address that the vehicle sends from, never to other senders."""
        for data, sender in datagrams:
            if not self.station.receive(data, self.now, self.time_usec()):
                continue
            if sender != self._peer:
                self._send()  # answers to the address before
                self._peer = sender
            if sender != self._judged:
                self.station.signing.is_private, self._judged = is_loopback(sender), sender
        self._send()

    async def _run_timer(self) -> None:
        while True:
            self.station.tick(self.now)
            self._send()
            await asyncio.sleep(TIMER_PERIOD)

    def _send(self) -> None:
        if self._peer is None or self._socket is None:
            return
        for data in self.station.outgoing(self.now, self.time_usec()):
            if not is_secret(data) or is_loopback(self._peer):  # the vehicle's address may have changed meanwhile
                self._socket.sendto(data, self._peer)

    def time_usec(self) -> int:
        """Time for the log: since 1970, from the wall clock at the start, which may be set during a recording."""
        return max(0, self._epoch + time.monotonic_ns() // 1000)
