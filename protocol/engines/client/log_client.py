"""Downloads the vehicle's recorded flights (https://mavlink.io/en/messages/common.html#LOG_REQUEST_LIST).

The vehicle streams the requested data once. When it falls silent, the missing parts are requested again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from protocol.dialect import mavlink
from protocol.engines.base import Engine, Remote, Retransmission, TransitionTable, fire
from protocol.errors import LocalProtocolError
from protocol.events import LogFailed, LogProgress, LogReceived, LogsListed, RemoteLog
from protocol.ranges import LOG_DATA_SIZE
from protocol.wire.message import Message, Source, target_fields

MAX_GAPS = 24  # requested at once
MAX_LOG_SIZE = 1 << 28  # [bytes]
_ALL = 0xFFFF

LOG_CLIENT_TRANSITIONS: TransitionTable = {
    ("idle", "list"): "listing",
    ("idle", "fetch"): "fetching",
    ("listing", "end"): "idle",
    ("fetching", "end"): "idle",
}


@dataclass(slots=True)
class _Download:
    log: RemoteLog
    data: bytearray
    missing: set[int] = field(default_factory=set)  # numbers of LOG_DATA messages


class LogClient(Engine[Message]):
    """Lists a vehicle's logs and downloads one at a time.

    Args:
        remote: The vehicle's timing, shared by all engines of this end.
    """

    def __init__(self, remote: Remote | None = None) -> None:
        super().__init__()
        self._vehicle: Source = (0, 0)
        self._state, self._resend = "idle", Retransmission(remote or Remote())
        self._found: dict[int, RemoteLog] = {}
        self._expected: range | None = None  # numbers in the list, once known
        self._download: _Download | None = None

    @property
    def is_busy(self) -> bool:
        """True while the list or a log is being downloaded."""
        return self._state != "idle"

    def request_list(self, vehicle: Source, now: float) -> None:
        """Download the list of logs; ends in ``LogsListed`` or ``LogFailed``.

        Raises:
            LocalProtocolError: The list or a log is being downloaded.
        """
        self._state = fire(LOG_CLIENT_TRANSITIONS, self._state, "list")
        self._vehicle, self._found, self._expected = vehicle, {}, None
        self._resend.start(now)
        self._out.append(mavlink.MAVLink_log_request_list_message(*vehicle, 0, _ALL))

    def fetch(self, vehicle: Source, log: RemoteLog, now: float) -> None:
        """Download a log of the list; ends in ``LogReceived`` or ``LogFailed``.

        Raises:
            LocalProtocolError: The list or a log is being downloaded, or the log is too large.
        """
        if log.size > MAX_LOG_SIZE:
            raise LocalProtocolError(f"log {log.number} has {log.size} bytes; the maximum is {MAX_LOG_SIZE}")
        self._state = fire(LOG_CLIENT_TRANSITIONS, self._state, "fetch")
        self._vehicle = vehicle
        self._download = _Download(log, bytearray(log.size), set(range(math.ceil(log.size / LOG_DATA_SIZE))))
        self._resend.start(now)
        if log.size == 0:
            self._finish(LogReceived(log, b""))
        else:
            self._request_data(log, 0, log.size)

    def cancel(self, reason: str) -> None:
        """End the download, if there is one."""
        if self.is_busy:
            self._finish(LogFailed(reason))

    def receive(self, message: Message, now: float) -> None:
        """Take a LOG_ENTRY or a LOG_DATA; unrequested ones are ignored."""
        if message.get_type() == "LOG_ENTRY" and self._state == "listing":
            self._take_entry(message, now)
        elif message.get_type() == "LOG_DATA" and self._download is not None:
            self._take_data(message, self._download, now)

    def next_deadline(self) -> float:
        """Link time at which missing parts must be requested again [s]."""
        return self._resend.deadline

    def handle_timer(self, now: float) -> None:
        """Request the missing parts again, or give up."""
        if now < self._resend.deadline:
            return
        if not self._resend.retry(now):
            self._finish(LogFailed("no answer"))
        elif self._download is not None:
            for start, end in self._gaps(self._download):
                self._request_data(self._download.log, start, end - start)
        else:
            missing = [n for n in self._expected or () if n not in self._found]
            first, last = (missing[0], missing[-1]) if missing else (0, _ALL)
            self._out.append(mavlink.MAVLink_log_request_list_message(*self._vehicle, first, last))

    def _request_data(self, log: RemoteLog, offset: int, count: int) -> None:
        request = mavlink.MAVLink_log_request_data_message(
            **target_fields(self._vehicle), id=log.number, ofs=offset, count=count
        )
        self._out.append(request)

    def _take_entry(self, message: Message, now: float) -> None:
        first = message.last_log_num - message.num_logs + 1
        if message.num_logs == 0:
            self._finish(LogsListed(()))
            return
        if not first <= message.id <= message.last_log_num or first < 0:
            return
        expected = range(first, message.last_log_num + 1)
        if expected != self._expected:  # also if a log was added meanwhile: start anew
            self._expected, self._found = expected, {}
        if message.id not in self._found:
            self._resend.answer(now)
            self._resend.wait(now)
        self._found[message.id] = RemoteLog(message.id, message.time_utc, message.size)
        if len(self._found) == len(expected):
            self._finish(LogsListed(tuple(self._found[n] for n in expected)))

    def _take_data(self, message: Message, download: _Download, now: float) -> None:
        at, count = message.ofs, message.count
        whole = min(LOG_DATA_SIZE, len(download.data) - at)
        if message.id != download.log.number or at % LOG_DATA_SIZE or whole <= 0:
            return
        if count < whole:
            if count == 0:  # the vehicle does not have these bytes (any more)
                self._finish(LogFailed(f"log {message.id} ends at byte {at} of {download.log.size}"))
            return
        number = at // LOG_DATA_SIZE
        if number not in download.missing:
            return
        download.data[at : at + whole] = bytes(message.data[:whole])
        download.missing.discard(number)
        self._resend.answer(now)
        self._resend.wait(now)
        total, count = len(download.data), math.ceil(len(download.data) / LOG_DATA_SIZE)
        self._events.append(LogProgress(min((count - len(download.missing)) * LOG_DATA_SIZE, total), total))
        if not download.missing:
            self._finish(LogReceived(download.log, bytes(download.data)))

    def _gaps(self, download: _Download) -> list[tuple[int, int]]:
        """The first missing ranges (offset, end) [bytes]."""
        gaps: list[tuple[int, int]] = []
        for number in sorted(download.missing):
            start, end = number * LOG_DATA_SIZE, min((number + 1) * LOG_DATA_SIZE, len(download.data))
            if gaps and gaps[-1][1] == start:
                gaps[-1] = (gaps[-1][0], end)
            elif len(gaps) == MAX_GAPS:
                break
            else:
                gaps.append((start, end))
        return gaps

    def _finish(self, event: LogsListed | LogReceived | LogFailed) -> None:
        if self._state == "fetching":
            self._out.append(mavlink.MAVLink_log_request_end_message(*self._vehicle))
        self._state = fire(LOG_CLIENT_TRANSITIONS, self._state, "end")
        self._download = None
        self._resend.stop()
        self._events.append(event)
