"""UDP socket and clock of a station: moves bytes, decides nothing."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time

from darko_gcs.errors import LinkError
from darko_gcs.station.station import Station
from protocol.loopback import is_loopback
from protocol.signing import is_secret

__all__ = ["UdpLink"]

Address = tuple[str, int]
TIMER_PERIOD = 0.02  # [s]
RECEIVE_BUFFER = 1 << 22  # for what twenty vehicles send while screens are drawn; the system may allow less [bytes]


class UdpLink(asyncio.DatagramProtocol):
    """Connects a station to the network until it is closed."""

    def __init__(self, station: Station) -> None:
        self.station = station
        self.port = 0  # local, once it is open
        self._peer: Address | None = None
        self._transport: asyncio.DatagramTransport | None = None
        self._timer: asyncio.Task[None] | None = None
        self._epoch = time.time_ns() // 1000 - time.monotonic_ns() // 1000  # of the monotonic clock, since 1970 [us]

    async def open(self, host: str, port: int) -> None:
        """Listen for the vehicle; with port 0, on any free port.

        Raises:
            LinkError: If the port is not available.
        """
        loop = asyncio.get_running_loop()
        try:
            transport, _ = await loop.create_datagram_endpoint(lambda: self, local_addr=(host, port))
        except (OSError, UnicodeError) as error:  # UnicodeError: the text cannot be a host name
            reason = getattr(error, "strerror", None) or "not a host name"
            raise LinkError(f"cannot listen on {host[:64]}:{port}: {reason}") from error
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
        self._transport = transport
        self._timer = asyncio.create_task(self._run_timer())
        self.port = int(transport.get_extra_info("sockname")[1])

    async def close(self) -> None:
        """Release the port and close the recording."""
        if self._timer is not None:
            self._timer.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._timer
        if self._transport is not None:
            self._transport.close()
        self.station.close()

    @property
    def words(self) -> str:
        """What the link does."""
        host, port = self._transport.get_extra_info("sockname")[:2] if self._transport is not None else ("", self.port)
        return f"Listening on {host}:{port}"

    @property
    def now(self) -> float:
        """The station's clock [s]."""
        return time.monotonic()

    def datagram_received(self, data: bytes, addr: Address) -> None:
        """Take a datagram. Answers go to the address that the vehicle sends from, never to other senders."""
        if self.station.receive(data, self.now, self.time_usec()):
            self._peer = addr
            self.station.signing.is_private = is_loopback(addr)
        self._send()

    def error_received(self, exc: Exception) -> None:
        """The vehicle's port is closed at the moment: a loss, not an error."""

    async def _run_timer(self) -> None:
        while True:
            self.station.tick(self.now)
            self._send()
            await asyncio.sleep(TIMER_PERIOD)

    def _send(self) -> None:
        if self._peer is None or self._transport is None:
            return
        for data in self.station.outgoing(self.now, self.time_usec()):
            if not is_secret(data) or is_loopback(self._peer):  # the vehicle's address may have changed meanwhile
                self._transport.sendto(data, self._peer)

    def time_usec(self) -> int:
        """Time for the log: since 1970, from the wall clock at the start, which may be set during a recording."""
        return max(0, self._epoch + time.monotonic_ns() // 1000)
