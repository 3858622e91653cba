"""UDP: moves datagrams, decides nothing."""

from __future__ import annotations

import contextlib
import select
import socket
from collections.abc import Hashable, Iterator
from typing import cast

from sitl.errors import SitlError

Address = tuple[str, int]
MOST_PER_POLL = 256  # a flood must not keep the vehicle from flying
LARGEST = 2048  # of a datagram that many bytes are taken: more than any network card's frame holds, and few orders


class PortError(SitlError):
    """The UDP port cannot be had."""


class UdpTransport:
    """One socket, never waiting for anybody."""

    def __init__(self, bind: Address) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind(bind)
        except OSError as error:
            self._socket.close()
            raise PortError(f"cannot listen on {bind[0]}:{bind[1]}: {error.strerror}") from error

    @property
    def port(self) -> int:
        """The local port."""
        return int(self._socket.getsockname()[1])

    def wait(self, timeout: float) -> None:
        """Sleep until a datagram arrives or ``timeout`` seconds have passed."""
        select.select([self._socket], [], [], timeout)

    def receive(self) -> Iterator[tuple[bytes, Address]]:
        """The datagrams that have arrived, at most ``MOST_PER_POLL``; what is not taken stays for the next call."""
        for _ in range(MOST_PER_POLL):
            try:
                data, peer = self._socket.recvfrom(LARGEST)
            except (BlockingIOError, InterruptedError):
                break
            except ConnectionError:  # nobody listens where the last datagram went: not our trouble
                continue
            yield data, peer

    def send(self, data: bytes, to: Hashable) -> None:
        """Send to one peer. One that is not there, or a full buffer, is not an error: it is loss."""
        with contextlib.suppress(OSError):
            self._socket.sendto(data, cast("Address", to))

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()
