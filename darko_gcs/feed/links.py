"""Links of a station: a UDP socket that waits, and ``udpout:``, ``tcp:`` and ``serial:``, which reach out."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import socket
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

from darko_gcs.errors import LinkError
from darko_gcs.station.station import Station
from protocol.tools.option_values import MAX_PORT, OUTWARD_KINDS, is_loopback
from protocol.wire.framing import FrameBuffer
from protocol.wire.signing import is_secret

Address = tuple[str, int]
Datagram = tuple[bytes, Address]
PORT_ADVICE = " (another darko-gcs? --port N takes another port, --connect reaches out to the vehicle)"
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


TIMER_PERIOD = 0.04  # [s]
ADDRESS_LIFE = 60.0  # after which nothing is sent any more to where a vehicle beside the first was heard [s]


class UdpLink:
    """Connects a station to the network until it is closed."""

    def __init__(self, station: Station) -> None:
        self.station = station
        self.port = 0  # local, once it is open
        self._peer: Address | None = None
        self._beside: dict[Address, float] = {}  # other addresses of vehicles, and when they were last heard [s]
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
            advice = PORT_ADVICE if getattr(error, "errno", None) == errno.EADDRINUSE else ""
            raise LinkError(f"cannot listen on {host[:64]}:{port}: {reason}{advice}") from error
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
        """Take datagrams. Answers go to the addresses that the vehicles send from, never to other senders."""
        for data, sender in datagrams:
            if not self.station.receive(data, self.now, self.time_usec()):
                if self.station.heard_beside:
                    self._beside[sender] = self.now
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
        self._beside = {to: heard for to, heard in self._beside.items() if self.now - heard < ADDRESS_LIFE}
        addresses = dict.fromkeys((self._peer, *self._beside))
        for data in self.station.outgoing(self.now, self.time_usec()):
            for address in addresses:
                if not is_secret(data) or is_loopback(address):  # an address may have changed meanwhile
                    self._socket.sendto(data, address)

    def time_usec(self) -> int:
        """Time for the log: since 1970, from the wall clock at the start, which may be set during a recording."""
        return max(0, self._epoch + time.monotonic_ns() // 1000)


DEFAULT_BAUD = 57600
RETRY_INTERVAL = 1.0  # between attempts to connect again [s]


class OutwardAddress(NamedTuple):
    """Address of an outgoing connection."""

    kind: str  # udpout, tcp or serial
    place: str  # host, or device
    number: int  # port, or baud rate

    @property
    def words(self) -> str:
        """As the user writes it."""
        return f"{self.kind}:{self.place}:{self.number}"


def outward_address(text: str) -> OutwardAddress | None:
    """An address to connect to; None for a local address to listen on.

    Raises:
        LinkError: It begins as one and is none.
    """
    kind, colon, rest = text.partition(":")
    if kind not in OUTWARD_KINDS or not colon:
        return None
    place, _, number = rest.rpartition(":")
    if kind == "serial" and not place:
        place, number = rest, str(DEFAULT_BAUD)
    form = "serial:DEVICE[:BAUD]" if kind == "serial" else f"{kind}:HOST:PORT"
    if not place or not number.isdecimal() or (kind != "serial" and not 0 < int(number) <= MAX_PORT):
        raise LinkError(f"{text}: an address is {form}")
    return OutwardAddress(kind, place, int(number))


def link_to(station: Station, host: str) -> UdpLink:
    """The link for an address: one that listens, or one that reaches out.

    Raises:
        LinkError: The address makes no sense.
    """
    address = outward_address(host)
    return UdpLink(station) if address is None else OutwardLink(station, address)


class OutwardLink(UdpLink):
    """Connects a station to one place. A stream that ends is opened again, once a second.

    Args:
        station: Talks to the vehicle.
        address: Where the vehicle is.
    """

    def __init__(self, station: Station, address: OutwardAddress) -> None:
        super().__init__(station)
        self._address = address
        self._stream: asyncio.WriteTransport | None = None
        self._frames = FrameBuffer()
        self._closed = False
        self._retry: asyncio.Task[None] | None = None

    @property
    def words(self) -> str:
        """State of the link, in words."""
        return f"Connecting to {self._address.words}"

    async def open(self, host: str, port: int) -> None:  # noqa: ARG002 - the address says where
        """Connect.

        Raises:
            LinkError: Nothing answers there, or the device cannot be opened.
        """
        await self._connect()
        self._timer = asyncio.create_task(self._run_timer())

    async def close(self) -> None:
        """End the connection and close the recording."""
        self._closed = True
        if self._retry is not None:
            self._retry.cancel()
        if self._stream is not None:
            self._stream.close()
        await super().close()

    async def _connect(self) -> None:
        loop, (kind, place, number) = asyncio.get_running_loop(), self._address
        try:
            if kind == "udpout":
                self._peer = await self._resolved(place, number)
                local = "127.0.0.1" if is_loopback(self._peer) else "0.0.0.0"  # noqa: S104 - the vehicle is elsewhere
                self._socket = await UdpSocket.bind(local, 0, self.take_datagrams)
                self.port = self._socket.address[1]
            elif kind == "tcp":
                self._stream, _ = await loop.create_connection(lambda: _Stream(self), place, number)
            else:
                self._stream = await _open_serial(self, place, number)
        except (OSError, UnicodeError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise LinkError(f"cannot connect to {self._address.words}: {reason}") from error

    async def _resolved(self, host: str, port: int) -> tuple[str, int]:
        found = await asyncio.get_running_loop().getaddrinfo(host, port, family=2)  # IPv4, as darko-sitl
        return str(found[0][4][0]), port

    def take(self, data: bytes) -> None:
        """Bytes of a stream arrived."""
        for frame in self._frames.feed(data):
            if self.station.receive(frame, self.now, self.time_usec()):
                self.station.signing.is_private = False
        self._send()

    def ended(self) -> None:
        """The stream ended: open it again."""
        self._stream = None
        if not self._closed:
            self._retry = asyncio.create_task(self._connect_again())

    async def _connect_again(self) -> None:
        while self._stream is None and not self._closed:
            await asyncio.sleep(RETRY_INTERVAL)
            try:
                await self._connect()
            except LinkError:
                continue

    def _send(self) -> None:
        if self._address.kind == "udpout":
            super()._send()
        elif self._stream is not None:
            for data in self.station.outgoing(self.now, self.time_usec()):
                if not is_secret(data):
                    self._stream.write(data)


class _Stream(asyncio.Protocol):
    """Bytes of a stream, for its link."""

    def __init__(self, link: OutwardLink) -> None:
        self._link = link

    def data_received(self, data: bytes) -> None:
        self._link.take(data)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's signature
        self._link.ended()


async def _open_serial(link: OutwardLink, device: str, baud: int) -> asyncio.WriteTransport:
    """A serial device as a stream.

    Raises:
        LinkError: Pyserial is not installed.
        OSError: The device cannot be opened.
    """
    try:
        from serial_asyncio_fast import create_serial_connection  # noqa: PLC0415 - an optional dependency
    except ImportError:
        raise LinkError("serial links need pyserial-asyncio-fast: pip install 'darko[serial]'") from None
    loop = asyncio.get_running_loop()
    try:
        transport, _ = await create_serial_connection(loop, lambda: _Stream(link), device, baudrate=baud)
    except ValueError as error:  # a baud rate that no device has
        raise OSError(str(error)) from error
    stream: asyncio.WriteTransport = transport
    return stream
