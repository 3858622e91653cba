"""A UDP socket that is emptied each time it wakes its owner."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable, Sequence

Address = tuple[str, int]
Datagram = tuple[bytes, Address]
MAX_AT_ONCE = 64  # datagrams; in a flood, the screen has its turn between them
MAX_DATAGRAM = 1 << 16  # [bytes]
RECEIVE_BUFFER = 1 << 22  # for what twenty vehicles send while screens are drawn; the system may allow less [bytes]


class UdpSocket:
    """Hands over all datagrams that wait: a vehicle sends ten messages at one instant, which is one wake-up.

    Args:
        bound: The socket.
        receive: Takes the datagrams with their senders.
    """

    def __init__(self, bound: socket.socket, receive: Callable[[Sequence[Datagram]], None]) -> None:
        self._socket, self._receive = bound, receive
        self.address: Address = bound.getsockname()[:2]  # its own
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(bound, self._read)

    @classmethod
    async def bind(cls, host: str, port: int, receive: Callable[[Sequence[Datagram]], None]) -> UdpSocket:
        """A socket on an address of this machine; with port 0, on any free port.

        Raises:
            OSError: The address is none of this machine, or in use.
            UnicodeError: The text cannot be a host name.
        """
        found = await asyncio.get_running_loop().getaddrinfo(host, port, type=socket.SOCK_DGRAM)
        return cls(_bound(found[0][0], found[0][4]), receive)

    def sendto(self, data: bytes, to: Address) -> None:
        """Send a datagram. One that the system does not take is lost, as others are on the way."""
        with contextlib.suppress(OSError):
            self._socket.sendto(data, to)

    def close(self) -> None:
        """Release the port."""
        self._loop.remove_reader(self._socket)
        self._socket.close()

    def _read(self) -> None:
        datagrams: list[Datagram] = []
        while len(datagrams) < MAX_AT_ONCE:
            try:
                data, sender = self._socket.recvfrom(MAX_DATAGRAM)
            except BlockingIOError:
                break
            except OSError:  # the port that we sent to is closed at the moment: a loss, not an error
                break
            datagrams.append((data, sender[:2]))
        if datagrams:
            self._receive(datagrams)


def _bound(family: int, address: tuple[object, ...]) -> socket.socket:
    new = socket.socket(family, socket.SOCK_DGRAM)
    try:
        new.setblocking(False)
        new.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
        new.bind(address)
    except OSError:
        new.close()
        raise
    return new
