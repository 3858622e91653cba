"""Recorded flights from the asking side (https://mavlink.io/en/messages/common.html#LOG_REQUEST_LIST).

The vehicle streams and repeats nothing by itself: when it falls silent, what is missing is asked for again.
"""

import math
from dataclasses import dataclass, field

from protocol.codec import Message, Source
from protocol.dialect import mavlink
from protocol.engines.base import Engine, Table, fire
from protocol.engines.log_server import CHUNK
from protocol.engines.retransmission import Partner, Resend
from protocol.errors import LocalProtocolError
from protocol.events import LogFailed, LogProgress, LogReceived, LogsListed, RemoteLog

__all__ = ["TRANSITIONS", "LogClient"]

RANGES = 24  # gaps asked for in one go
LARGEST = 1 << 28  # bytes a log may have
_ALL = 0xFFFF

TRANSITIONS: Table = {
    ("idle", "list"): "listing",
    ("idle", "fetch"): "fetching",
    ("listing", "end"): "idle",
    ("fetching", "end"): "idle",
}


@dataclass(slots=True)
class _Download:
    log: RemoteLog
    data: bytearray
    missing: set[int] = field(default_factory=set)  # numbers of chunks


class LogClient(Engine[Message]):
    """Lists a vehicle's logs and downloads one at a time.

    Args:
        partner: The vehicle as all engines of this end know it.
    """

    def __init__(self, partner: Partner | None = None) -> None:
        super().__init__()
        self._vehicle: Source = (0, 0)
        self._state, self._resend = "idle", Resend(partner or Partner())
        self._found: dict[int, RemoteLog] = {}
        self._expected: range | None = None  # numbers of the list, once known
        self._download: _Download | None = None

    @property
    def is_busy(self) -> bool:
        """True while a list or a log is under way."""
        return self._state != "idle"

    def request_list(self, vehicle: Source, now: float) -> None:
        """Ask what logs there are; ends in ``LogsListed`` or ``LogFailed``.

        Raises:
            LocalProtocolError: A list or a log is under way.
        """
        self._state = fire(TRANSITIONS, self._state, "list")
        self._vehicle, self._found, self._expected = vehicle, {}, None
        self._resend.start(now)
        self._out.append(mavlink.MAVLink_log_request_list_message(*vehicle, 0, _ALL))

    def fetch(self, vehicle: Source, log: RemoteLog, now: float) -> None:
        """Download a log that was listed; ends in ``LogReceived`` or ``LogFailed``.

        Raises:
            LocalProtocolError: A list or a log is under way, or the log is too large to be kept.
        """
        if log.size > LARGEST:
            raise LocalProtocolError(f"log {log.number} has {log.size} bytes; at most {LARGEST} are downloaded")
        self._state = fire(TRANSITIONS, self._state, "fetch")
        self._vehicle = vehicle
        self._download = _Download(log, bytearray(log.size), set(range(math.ceil(log.size / CHUNK))))
        self._resend.start(now)
        if log.size == 0:
            self._finish(LogReceived(log, b""))
        else:
            self._out.append(mavlink.MAVLink_log_request_data_message(*vehicle, log.number, 0, log.size))

    def cancel(self, reason: str) -> None:
        """Give up on what is under way."""
        if self.is_busy:
            self._finish(LogFailed(reason))

    def receive(self, message: Message, now: float) -> None:
        """Take a LOG_ENTRY or a LOG_DATA; what nobody asked for is ignored."""
        if message.get_type() == "LOG_ENTRY" and self._state == "listing":
            self._take_entry(message, now)
        elif message.get_type() == "LOG_DATA" and self._download is not None:
            self._take_data(message, self._download, now)

    def next_deadline(self) -> float:
        """When silence has lasted too long."""
        return self._resend.deadline

    def handle_timer(self, now: float) -> None:
        """Ask again for what is missing, or give up."""
        if now < self._resend.deadline:
            return
        if not self._resend.retry(now):
            self._finish(LogFailed("no answer"))
        elif self._download is not None:
            for start, end in self._gaps(self._download):
                request = mavlink.MAVLink_log_request_data_message(
                    *self._vehicle, self._download.log.number, start, end - start
                )
                self._out.append(request)
        else:
            missing = [n for n in self._expected or () if n not in self._found]
            first, last = (missing[0], missing[-1]) if missing else (0, _ALL)
            self._out.append(mavlink.MAVLink_log_request_list_message(*self._vehicle, first, last))

    def _take_entry(self, message: Message, now: float) -> None:
        first = message.last_log_num - message.num_logs + 1
        if message.num_logs == 0:
            self._finish(LogsListed(()))
            return
        if not first <= message.id <= message.last_log_num or first < 0:
            return
        expected = range(first, message.last_log_num + 1)
        if expected != self._expected:  # also when a log was added under way: all over again
            self._expected, self._found = expected, {}
        if message.id not in self._found:
            self._resend.answer(now)
            self._resend.wait(now)
        self._found[message.id] = RemoteLog(message.id, message.time_utc, message.size)
        if len(self._found) == len(expected):
            self._finish(LogsListed(tuple(self._found[n] for n in expected)))

    def _take_data(self, message: Message, download: _Download, now: float) -> None:
        at, count = message.ofs, message.count
        whole = min(CHUNK, len(download.data) - at)
        if message.id != download.log.number or at % CHUNK or whole <= 0:
            return
        if count < whole:
            if count == 0:  # the vehicle has no such bytes (any more)
                self._finish(LogFailed(f"log {message.id} ends at byte {at} of {download.log.size}"))
            return
        number = at // CHUNK
        if number not in download.missing:
            return
        download.data[at : at + whole] = bytes(message.data[:whole])
        download.missing.discard(number)
        self._resend.answer(now)
        self._resend.wait(now)
        total, count = len(download.data), math.ceil(len(download.data) / CHUNK)
        self._events.append(LogProgress(min((count - len(download.missing)) * CHUNK, total), total))
        if not download.missing:
            self._finish(LogReceived(download.log, bytes(download.data)))

    def _gaps(self, download: _Download) -> list[tuple[int, int]]:
        """The first missing ranges (offset, end) in bytes."""
        gaps: list[tuple[int, int]] = []
        for number in sorted(download.missing):
            start, end = number * CHUNK, min((number + 1) * CHUNK, len(download.data))
            if gaps and gaps[-1][1] == start:
                gaps[-1] = (gaps[-1][0], end)
            elif len(gaps) == RANGES:
                break
            else:
                gaps.append((start, end))
        return gaps

    def _finish(self, event: LogsListed | LogReceived | LogFailed) -> None:
        if self._state == "fetching":
            self._out.append(mavlink.MAVLink_log_request_end_message(*self._vehicle))
        self._state = fire(TRANSITIONS, self._state, "end")
        self._download = None
        self._resend.stop()
        self._events.append(event)
