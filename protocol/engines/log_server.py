"""Recorded flights for peers to list and download (https://mavlink.io/en/messages/common.html#LOG_REQUEST_LIST).

Logs are numbered from 0, oldest first, in the order a peer was told them last: a new or deleted log renumbers
nothing under way. A request is a range of bytes; a client that lost some asks for many ranges one after the other,
and gets them all.
"""

import math
from collections import OrderedDict, deque
from contextlib import suppress
from dataclasses import dataclass, field

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.base import Peer, Server, addressed_to
from protocol.engines.files import File, Log, LogStore
from protocol.events import LogEraseRequested

__all__ = ["CHUNK", "RANGES", "LogServer"]

CHUNK = 90  # bytes in one LOG_DATA
PEERS = 8  # served at once; one more replaces the one that has been silent longest
RANGES = 32  # a peer may have asked for and not got yet
BEAT, MESSAGES = 0.01, 10  # that many messages [-] go out every beat [s]: no receive buffer overflows


@dataclass(slots=True)
class _Client:
    logs: tuple[Log, ...] = ()
    entries: deque[int] = field(default_factory=deque)  # numbers that are to be told
    number: int = -1  # the log it reads
    file: File | None = None
    ranges: deque[tuple[int, int]] = field(default_factory=deque)  # (offset, end) still to be sent
    asked: deque[tuple[int, int]] = field(default_factory=deque)  # the same as they were asked for

    @property
    def is_waiting(self) -> bool:
        return bool(self.entries or self.ranges)

    def stop(self) -> None:
        self.ranges.clear()
        self.asked.clear()
        if self.file is not None:
            self.file.close()
        self.file, self.number = None, -1


class LogServer(Server):
    """Serves a store of logs. Erasing is for the owner to do: it is told with ``LogEraseRequested``."""

    def __init__(self, system: int, component: int, store: LogStore) -> None:
        super().__init__()
        self._system, self._component, self._store = system, component, store
        self._clients: OrderedDict[Peer, _Client] = OrderedDict()
        self._beat = math.inf
        self._handlers = {
            "LOG_REQUEST_LIST": self._handle_list,
            "LOG_REQUEST_DATA": self._handle_data,
            "LOG_REQUEST_END": self._handle_end,
            "LOG_ERASE": self._handle_erase,
        }
        self.handles = frozenset(self._handlers)

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take a request of the log protocol."""
        handler = self._handlers.get(message.get_type())
        if handler is not None and addressed_to(message, self._system, self._component):
            handler(message, now, peer)

    def next_deadline(self) -> float:
        """When the next part goes out."""
        return self._beat

    def handle_timer(self, now: float) -> None:
        """Send the next part of what was asked for; all peers share the beat."""
        if now < self._beat:
            return
        waiting = [(peer, client) for peer, client in self._clients.items() if client.is_waiting]
        for at in range(MESSAGES if waiting else 0):
            self._continue(*waiting[at % len(waiting)])
        busy = any(client.is_waiting for client in self._clients.values())
        self._beat = now + BEAT if busy else math.inf

    def _handle_list(self, message: Message, now: float, peer: Peer) -> None:
        client = self._client(peer)
        if message.start == 0 or not client.logs:  # a later start fills gaps of the list it has
            client.stop()
            client.logs = tuple(self._store.logs())
        last = min(message.end, len(client.logs) - 1)
        client.entries = deque(range(message.start, last + 1))
        if not client.logs:
            self._reply(peer, mavlink.MAVLink_log_entry_message(0, 0, 0, 0, 0))
        self._start(now)

    def _handle_data(self, message: Message, now: float, peer: Peer) -> None:
        client = self._client(peer)
        client.logs = client.logs or tuple(self._store.logs())
        if client.number != message.id:
            client.stop()
            if message.id < len(client.logs):
                with suppress(OSError):  # deleted since it was listed
                    client.file = self._store.open(client.logs[message.id].name)
                    client.number = message.id
        wanted = (message.ofs, message.ofs + message.count)
        if client.file is None or message.ofs >= client.file.size:
            self._reply(peer, _data(message.id, message.ofs, b""))  # at once, where clients wait on silence
        elif wanted not in client.asked and len(client.ranges) < RANGES:
            client.ranges.append(wanted)
            client.asked.append(wanted)
            self._start(now)

    def _handle_end(self, _message: Message, _now: float, peer: Peer) -> None:
        if peer in self._clients:
            self._clients.pop(peer).stop()

    def _handle_erase(self, _message: Message, _now: float, _peer: Peer) -> None:
        self._events.append(LogEraseRequested())

    def _client(self, peer: Peer) -> _Client:
        client = self._clients.setdefault(peer, _Client())
        self._clients.move_to_end(peer)
        if len(self._clients) > PEERS:
            self._clients.popitem(last=False)[1].stop()
        return client

    def _start(self, now: float) -> None:
        if math.isinf(self._beat):
            self._beat = now

    def _continue(self, peer: Peer, client: _Client) -> None:
        if client.entries:
            number, count = client.entries.popleft(), len(client.logs)
            log = client.logs[number]
            self._reply(peer, mavlink.MAVLink_log_entry_message(number, count, count - 1, log.time_utc, log.size))
        elif client.ranges and client.file is not None:
            self._send_data(peer, client, client.file)

    def _send_data(self, peer: Peer, client: _Client, file: File) -> None:
        offset, end = client.ranges[0]
        try:
            data = file.read(offset, max(min(CHUNK, end - offset, file.size - offset), 0))
        except OSError:
            data = b""  # ends the log where it cannot be read
        self._reply(peer, _data(client.number, offset, data))
        offset += len(data)
        # A log whose last message is full is ended by an empty one, if the range goes beyond the end.
        if offset >= end or len(data) < CHUNK:
            client.ranges.popleft()
            client.asked.popleft()
        else:
            client.ranges[0] = (offset, end)


def _data(number: int, offset: int, data: bytes) -> Message:
    return mavlink.MAVLink_log_data_message(number, offset, len(data), list(data.ljust(CHUNK, b"\0")))
