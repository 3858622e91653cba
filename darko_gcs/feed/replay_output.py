"""Sends what a replay plays to another ground station, while the operator wants it."""

from __future__ import annotations

import asyncio

from darko_gcs.errors import LinkError
from darko_gcs.feed.outward_link import OutwardAddress
from darko_gcs.feed.played_frames import played_frames
from darko_gcs.feed.udp_socket import Address, UdpSocket
from protocol.tlog import TlogReader
from protocol.tools.option_values import is_loopback


class ReplayOutput:
    """Frames of a log, one a datagram, byte for byte; answers are not heeded.

    Args:
        reader: The log.
        address: Where the other station listens.

    Attributes:
        sent: Frames sent.
    """

    def __init__(self, reader: TlogReader, address: OutwardAddress) -> None:
        self._reader, self._address = reader, address
        self._rows: frozenset[int] = frozenset()  # records that are sent
        self._socket: UdpSocket | None = None
        self._to: Address = ("", 0)
        self.sent = 0

    @property
    def words(self) -> str:
        """Present destination; empty while nothing is sent."""
        return "" if self._socket is None else f"{self._address.place}:{self._address.number}"

    async def start(self) -> None:
        """Send what is played from now on.

        Raises:
            LinkError: The log has nothing to send, or there is no way to the address.
        """
        frames = played_frames(self._reader)
        if not len(frames.rows):
            raise LinkError(f"nothing to send: {frames.words}")
        self._rows = frozenset(frames.rows.tolist())
        place, number = self._address.place, self._address.number
        try:
            found = await asyncio.get_running_loop().getaddrinfo(place, number, family=2)  # IPv4, as darko-sitl
            self._to = (str(found[0][4][0]), number)
            local = "127.0.0.1" if is_loopback(self._to) else "0.0.0.0"  # noqa: S104 - the other one is elsewhere
            self._socket = await UdpSocket.bind(local, 0, lambda _: None)
        except (OSError, UnicodeError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise LinkError(f"cannot send to {self._address.words}: {reason}") from error

    def stop(self) -> None:
        """Send no more."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def send(self, rows: range) -> None:
        """Send these records, if it is on; those that are no vehicle's are left out."""
        if self._socket is None:
            return
        for row in rows:
            if row in self._rows:
                self._socket.sendto(self._reader.frame(row), self._to)
                self.sent += 1
