"""A UDP socket: it moves datagrams and decides nothing."""

from __future__ import annotations

import contextlib
import select
import socket
from collections.abc import Hashable, Iterator
from typing import cast

from sitl.errors import SitlError

Address = tuple[str, int]
MAX_DATAGRAMS_PER_POLL = 256  # a flood must not keep the vehicle from flying
MAX_DATAGRAM = 2048  # bytes taken of a datagram: more than a network card's frame holds, and room for few commands only


class PortError(SitlError):
    """The UDP port cannot be opened."""


class UdpTransport:
    """One socket that never blocks.

    Args:
        bind: Local address and port.

    Raises:
        PortError: The port cannot be opened.
    """

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

    def fileno(self) -> int:
        """The socket's descriptor, to wait for several at once."""
        return self._socket.fileno()

    def wait(self, timeout: float) -> None:
        """Sleep until a datagram arrives or ``timeout`` seconds have passed."""
        select.select([self._socket], [], [], timeout)

    def receive(self) -> Iterator[tuple[bytes, Address]]:
        """The datagrams that have arrived, at most ``MAX_DATAGRAMS_PER_POLL``; the next call gives the others."""
        for _ in range(MAX_DATAGRAMS_PER_POLL):
            try:
                data, peer = self._socket.recvfrom(MAX_DATAGRAM)
            except (BlockingIOError, InterruptedError):
                break
            except ConnectionError:  # nobody listens where the last datagram went: no error of this side
                continue
            yield data, peer

    def send(self, data: bytes, to: Hashable) -> None:
        """Send to one peer. A missing peer or a full buffer is no error: the datagram is lost."""
        with contextlib.suppress(OSError):
            self._socket.sendto(data, cast("Address", to))

    def close(self) -> None:
        """Release the port."""
        self._socket.close()
