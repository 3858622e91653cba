"""A TCP server for one client at a time, that never blocks: it moves bytes and decides nothing."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Hashable, Iterator

from sitl.mavlink.transport import Address, PortError

MAX_BACKLOG = 1 << 20  # bytes that a client has not read: then it is taken to have died
MAX_READ = 1 << 16  # bytes taken at once


class StreamPort:
    """One listening socket, and its newest client.

    Args:
        bind: Local address and port.

    Raises:
        PortError: The port cannot be opened.
    """

    def __init__(self, bind: Address) -> None:
        self._server = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._server.setblocking(False)
        self._client: socket.socket | None = None
        self._backlog, self._events = bytearray(), list[str]()
        try:
            self._server.bind(bind)
            self._server.listen(1)
        except OSError as error:
            self._server.close()
            raise PortError(f"cannot listen on {bind[0]}:{bind[1]}: {error.strerror}") from error

    @property
    def port(self) -> int:
        """The local port."""
        return int(self._server.getsockname()[1])

    def fileno(self) -> int:
        """The listening socket's descriptor, to wait for."""
        return self._server.fileno()

    def sockets(self) -> list[int]:
        """The client's descriptor, if there is one."""
        return [] if self._client is None else [self._client.fileno()]

    def events(self) -> list[str]:
        """``opened`` and ``closed``, in their order since the last call; a new client takes the place of the old."""
        with contextlib.suppress(BlockingIOError, ConnectionError):
            client, _ = self._server.accept()
            if self._client is not None:
                self._drop()
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client = client
            self._events.append("opened")
        events, self._events = self._events, []
        return events

    def receive(self) -> Iterator[tuple[bytes, Hashable]]:
        """The bytes that have arrived."""
        if self._client is None:
            return
        try:
            data = self._client.recv(MAX_READ)
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            data = b""
        if data:
            yield data, None
        else:
            self._drop()

    def send(self, data: bytes, to: Hashable) -> None:  # noqa: ARG002 - there is one client alone
        """Send to the client; what it does not read waits, up to a limit."""
        if self._client is None:
            return
        self._backlog += data
        try:
            sent = self._client.send(self._backlog)
        except (BlockingIOError, InterruptedError):
            sent = 0
        except OSError:
            self._drop()
            return
        del self._backlog[:sent]
        if len(self._backlog) > MAX_BACKLOG:
            self._drop()

    def _drop(self) -> None:
        if self._client is not None:
            self._client.close()
        self._client, self._backlog = None, bytearray()
        self._events.append("closed")

    def close(self) -> None:
        """Release the port."""
        if self._client is not None:
            self._client.close()
        self._server.close()
