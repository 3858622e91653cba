"""Datagrams from the process that listens on the port to those that fly vehicles; these send by the port themselves."""

from __future__ import annotations

import contextlib
import select
import socket
import struct
from collections.abc import Hashable, Iterator
from typing import Self

from sitl.mavlink.transport import MAX_DATAGRAM, MAX_DATAGRAMS_PER_POLL, Address, UdpTransport

PEER = struct.Struct("!4sH")  # before each datagram: IPv4 address and port that it came from


class InboxOutlet:
    """The listening process's end."""

    def __init__(self, link: socket.socket) -> None:
        self._link = link
        link.setblocking(False)

    def put(self, data: bytes, peer: Address) -> None:
        """Pass a datagram on. A full link is no error: the datagram is lost, as in a full socket."""
        with contextlib.suppress(OSError):
            self._link.send(PEER.pack(socket.inet_aton(peer[0]), peer[1]) + data)

    def close(self) -> None:
        """Tell the other end that nothing more will come."""
        self._link.close()


class Inbox:
    """The flying process's end; a transport as ``UdpTransport`` is.

    Args:
        link: Where datagrams come from.
        port: Where they are sent by.
    """

    def __init__(self, link: socket.socket, port: UdpTransport) -> None:
        self._link, self._port = link, port
        self.is_closed = False  # the listening process has ended
        link.setblocking(False)

    @classmethod
    def pair(cls, port: UdpTransport) -> tuple[InboxOutlet, Self]:
        """Both ends of a new link: whole datagrams in order, and an end that is noticed."""
        one, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        return InboxOutlet(one), cls(other, port)

    def wait(self, timeout: float) -> None:
        """Sleep until a datagram arrives or ``timeout`` seconds have passed."""
        select.select([self._link], [], [], timeout)

    def receive(self) -> Iterator[tuple[bytes, Address]]:
        """The datagrams that have arrived, at most ``MAX_DATAGRAMS_PER_POLL``; the next call gives the others."""
        for _ in range(MAX_DATAGRAMS_PER_POLL):
            try:
                packet = self._link.recv(PEER.size + MAX_DATAGRAM)
            except (BlockingIOError, InterruptedError):
                break
            except ConnectionError:
                packet = b""
            if not packet:
                self.is_closed = True
                break
            host, port = PEER.unpack_from(packet)
            yield packet[PEER.size :], (socket.inet_ntoa(host), port)

    def send(self, data: bytes, to: Hashable) -> None:
        """Send to one peer (as ``UdpTransport.send``)."""
        self._port.send(data, to)

    def close(self) -> None:
        """Release this end."""
        self._link.close()
