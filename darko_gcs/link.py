"""UDP on loopback and the clock: moves bytes for a station, decides nothing."""

from __future__ import annotations

import asyncio
import contextlib
import time

from darko_gcs.errors import LinkError
from darko_gcs.signing import is_loopback
from darko_gcs.station import Station
from protocol.signing import is_secret

__all__ = ["Link"]

Address = tuple[str, int]
TICK = 0.02  # [s] between looks at the station's timers


class Link(asyncio.DatagramProtocol):
    """Connects a station to the network until it is closed."""

    def __init__(self, station: Station) -> None:
        self.station = station
        self._peer: Address | None = None
        self._transport: asyncio.DatagramTransport | None = None
        self._timer: asyncio.Task[None] | None = None
        self._epoch = time.time_ns() // 1000 - time.monotonic_ns() // 1000  # of the steady clock, since 1970 [us]

    async def open(self, host: str, port: int) -> int:
        """Listen for the vehicle. Returns the port (another than asked for if that was 0).

        Raises:
            LinkError: If the port cannot be had.
        """
        loop = asyncio.get_running_loop()
        try:
            transport, _ = await loop.create_datagram_endpoint(lambda: self, local_addr=(host, port))
        except (OSError, UnicodeError) as error:  # a name that no name can be is the latter
            reason = getattr(error, "strerror", None) or "no host has such a name"
            raise LinkError(f"cannot listen on {host[:64]}:{port}: {reason}") from error
        self._transport = transport
        self._timer = asyncio.create_task(self._keep_time())
        return int(transport.get_extra_info("sockname")[1])

    async def close(self) -> None:
        """Give the port back and close the recording."""
        if self._timer is not None:
            self._timer.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._timer
        if self._transport is not None:
            self._transport.close()
        self.station.close()

    @property
    def now(self) -> float:
        """The station's clock [s]."""
        return time.monotonic()

    def datagram_received(self, data: bytes, addr: Address) -> None:
        """A datagram came; where the vehicle speaks from is where answers go, whoever else may send here."""
        if self.station.receive(data, self.now, self._time_usec()):
            self._peer = addr
            self.station.signing.is_private = is_loopback(addr[0])
        self._send()

    def error_received(self, exc: Exception) -> None:
        """The vehicle's port is closed for now: loss, not an error."""

    async def _keep_time(self) -> None:
        while True:
            self.station.tick(self.now)
            self._send()
            await asyncio.sleep(TICK)

    def _send(self) -> None:
        if self._peer is None or self._transport is None:
            return
        for data in self.station.outgoing(self.now, self._time_usec()):
            if not is_secret(data) or is_loopback(self._peer[0]):  # the vehicle may have moved since it was asked
                self._transport.sendto(data, self._peer)

    def _time_usec(self) -> int:
        """For the log: since 1970, as the wall clock had it at the start; it may be set while a flight is recorded."""
        return max(0, self._epoch + time.monotonic_ns() // 1000)
