"""UDP on loopback: moves datagrams, decides nothing."""

from __future__ import annotations

import contextlib
import select
import socket

from sitl.errors import SitlError

Address = tuple[str, int]
MOST_PER_POLL = 256  # a flood must not keep the vehicle from flying
FORGET_AFTER = 64  # learnt peers beyond this replace the oldest


class PortError(SitlError):
    """The UDP port cannot be had."""


class UdpTransport:
    """One socket; sends telemetry to the configured peers and to all that have spoken."""

    def __init__(self, bind: Address, peers: list[Address]) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind(bind)
        except OSError as error:
            self._socket.close()
            raise PortError(f"cannot listen on {bind[0]}:{bind[1]}: {error.strerror}") from error
        self._configured = list(peers)
        self._learnt: dict[Address, None] = {}

    @property
    def port(self) -> int:
        """The local port."""
        return int(self._socket.getsockname()[1])

    def wait(self, timeout: float) -> None:
        """Sleep until a datagram arrives or ``timeout`` seconds have passed."""
        select.select([self._socket], [], [], timeout)

    def receive(self) -> list[tuple[bytes, Address]]:
        """The datagrams that have arrived, at most ``MOST_PER_POLL``."""
        got: list[tuple[bytes, Address]] = []
        while len(got) < MOST_PER_POLL:
            try:
                data, peer = self._socket.recvfrom(65535)
            except (BlockingIOError, InterruptedError):
                break
            except ConnectionError:  # nobody listens where the last datagram went: not our trouble
                continue
            self._learn(peer)
            got.append((data, peer))
        return got

    def send(self, data: bytes, to: Address | None = None) -> None:
        """Send to one peer, or to all. A peer that is not there, or a full buffer, is not an error: it is loss."""
        for address in [to] if to is not None else self._everyone():
            with contextlib.suppress(OSError):
                self._socket.sendto(data, address)

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    def _everyone(self) -> list[Address]:
        return self._configured + [peer for peer in self._learnt if peer not in self._configured]

    def _learn(self, peer: Address) -> None:
        self._learnt[peer] = None
        while len(self._learnt) > FORGET_AFTER:
            del self._learnt[next(iter(self._learnt))]
