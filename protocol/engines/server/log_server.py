"""Lets peers list and download recorded flights (https://mavlink.io/en/messages/common.html#LOG_REQUEST_LIST).

Logs are numbered from 0, oldest first. Each peer keeps the numbers of its last list, so a new or deleted log changes no
download in progress. A request is a range of bytes; a client that lost data requests many ranges one after the other
and gets all of them.
"""

from __future__ import annotations

import math
from collections import OrderedDict, deque
from contextlib import suppress
from dataclasses import dataclass, field

from protocol.dialect import mavlink
from protocol.engines.base import Server
from protocol.engines.file_transfer import File, Log, LogStore
from protocol.events import LogEraseRequested
from protocol.ranges import LOG_DATA_SIZE, MESSAGES_PER_INTERVAL, SEND_INTERVAL
from protocol.wire.message import Message, Peer, addressed_to

MAX_LOG_CLIENTS = 8  # one more replaces the one that has been silent longest
MAX_OPEN_RANGES = 32  # requested by one peer and not sent yet


@dataclass(slots=True, kw_only=True)
class _Client:
    logs: tuple[Log, ...] = ()
    entries: deque[int] = field(default_factory=deque)  # numbers still to be listed
    number: int = -1  # the log it downloads
    file: File | None = None
    ranges: deque[tuple[int, int]] = field(default_factory=deque)  # (offset, end) still to be sent
    asked: deque[tuple[int, int]] = field(default_factory=deque)  # the same as requested

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
    """Serves a store of logs. The owner erases them upon ``LogEraseRequested``."""

    def __init__(self, system: int, component: int, store: LogStore) -> None:
        super().__init__()
        self._system, self._component, self._store = system, component, store
        self._clients: OrderedDict[Peer, _Client] = OrderedDict()
        self._deadline = math.inf
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
        """Link time at which the next part is due [s]."""
        return self._deadline

    def handle_timer(self, now: float) -> None:
        """Send the next messages; all peers share the rate."""
        if now < self._deadline:
            return
        waiting = [(peer, client) for peer, client in self._clients.items() if client.is_waiting]
        for at in range(MESSAGES_PER_INTERVAL if waiting else 0):
            self._continue(*waiting[at % len(waiting)])
        busy = any(client.is_waiting for client in self._clients.values())
        self._deadline = now + SEND_INTERVAL if busy else math.inf

    def _handle_list(self, message: Message, now: float, peer: Peer) -> None:
        client = self._client(peer)
        if message.start == 0 or not client.logs:  # a later start fills gaps of its list
            client.stop()
            client.logs = tuple(self._store.logs())
        last = min(message.end, len(client.logs) - 1)
        client.entries = deque(range(message.start, last + 1))
        if not client.logs:
            self._reply(peer, _entry(number=0, count=0, last=0, time_utc=0, size=0))
        self._start(now)

    def _handle_data(self, message: Message, now: float, peer: Peer) -> None:
        client = self._client(peer)
        client.logs = client.logs or tuple(self._store.logs())
        if client.number != message.id:
            client.stop()
            if message.id < len(client.logs):
                with suppress(OSError):  # deleted since the list was sent
                    client.file = self._store.open(client.logs[message.id].name)
                    client.number = message.id
        wanted = (message.ofs, message.ofs + message.count)
        if client.file is None or message.ofs >= client.file.size:
            self._reply(peer, _data(message.id, message.ofs, b""))  # at once: without it, clients wait for a timeout
        elif wanted not in client.asked and len(client.ranges) < MAX_OPEN_RANGES:
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
        if len(self._clients) > MAX_LOG_CLIENTS:
            self._clients.popitem(last=False)[1].stop()
        return client

    def _start(self, now: float) -> None:
        if math.isinf(self._deadline):
            self._deadline = now

    def _continue(self, peer: Peer, client: _Client) -> None:
        if client.entries:
            number, count = client.entries.popleft(), len(client.logs)
            log = client.logs[number]
            self._reply(peer, _entry(number=number, count=count, last=count - 1, time_utc=log.time_utc, size=log.size))
        elif client.ranges and client.file is not None:
            self._send_data(peer, client, client.file)

    def _send_data(self, peer: Peer, client: _Client, file: File) -> None:
        offset, end = client.ranges[0]
        try:
            data = file.read(offset, max(min(LOG_DATA_SIZE, end - offset, file.size - offset), 0))
        except OSError:
            data = b""  # ends the log where it cannot be read
        self._reply(peer, _data(client.number, offset, data))
        offset += len(data)
        # After a full last message an empty one ends the log, if the range goes beyond the end.
        if offset >= end or len(data) < LOG_DATA_SIZE:
            client.ranges.popleft()
            client.asked.popleft()
        else:
            client.ranges[0] = (offset, end)


def _entry(*, number: int, count: int, last: int, time_utc: int, size: int) -> Message:
    return mavlink.MAVLink_log_entry_message(id=number, num_logs=count, last_log_num=last, time_utc=time_utc, size=size)


def _data(number: int, offset: int, data: bytes) -> Message:
    return mavlink.MAVLink_log_data_message(number, offset, len(data), list(data.ljust(LOG_DATA_SIZE, b"\0")))
