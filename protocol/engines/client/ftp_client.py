"""Downloads files of the vehicle by MAVLink FTP (https://mavlink.io/en/services/ftp.html).

A file is read in bursts. What a burst left out is read part by part if little is missing, by another burst if much is.
One file is read at a time; further requests wait.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from protocol.dialect import mavlink
from protocol.engines.base import Engine, Remote, Retransmission, TransitionTable, fire
from protocol.engines.file_transfer import MAX_DATA, FtpPacket
from protocol.errors import LocalProtocolError
from protocol.events import FileFailed, FileProgress, FileReceived
from protocol.names import enum_name
from protocol.wire.message import Message, Source, addressed_to

MAX_OPEN_READS = 8  # parts requested at once
MAX_FILE_SIZE = 1 << 28  # [bytes]

_ACK, _NAK = mavlink.MAV_FTP_OPCODE_ACK, mavlink.MAV_FTP_OPCODE_NAK
_OPEN, _CLOSE = mavlink.MAV_FTP_OPCODE_OPENFILERO, mavlink.MAV_FTP_OPCODE_TERMINATESESSION
_READ, _BURST = mavlink.MAV_FTP_OPCODE_READFILE, mavlink.MAV_FTP_OPCODE_BURSTREADFILE
_EOF = mavlink.MAV_FTP_ERR_EOF

FTP_CLIENT_TRANSITIONS: TransitionTable = {
    ("idle", "read"): "opening",
    ("opening", "end"): "idle",
    ("opening", "opened"): "reading",
    ("reading", "end"): "closing",
    ("closing", "end"): "idle",
}


@dataclass(slots=True, kw_only=True)
class _FileDownload:
    path: str
    session: int = 0
    data: bytearray = field(default_factory=bytearray)
    missing: set[int] = field(default_factory=set)  # numbers of parts
    pending: set[int] = field(default_factory=set)  # parts requested one by one


class FtpClient(Engine[Message]):
    """Reads files of one vehicle at a time; every request ends in an event.

    Args:
        system: Own system id.
        component: Own component id.
        remote: The vehicle's timing, shared by all engines of this end.
    """

    def __init__(self, system: int, component: int, remote: Remote | None = None) -> None:
        super().__init__()
        self._system, self._component = system, component
        self._vehicle: Source = (0, 0)
        self._queue: deque[tuple[Source, _FileDownload]] = deque()
        self._state, self._resend = "idle", Retransmission(remote or Remote())
        self._download: _FileDownload | None = None
        self._requests: dict[int, FtpPacket] = {}  # unanswered, by sequence number
        self._seq, self._session = 0, 0
        self._burst = 0  # sequence number of the newest burst request

    @property
    def is_busy(self) -> bool:
        """True while a file is being read or a request waits."""
        return self._download is not None or bool(self._queue)

    def read(self, vehicle: Source, path: str, now: float) -> None:
        """Download a file; ends in ``FileReceived`` or ``FileFailed``.

        Raises:
            LocalProtocolError: The path does not fit the wire.
        """
        if not (path.isascii() and len(path) <= MAX_DATA and "\0" not in path):
            raise LocalProtocolError(f"path {path!r} is not at most {MAX_DATA} ASCII characters")
        self._queue.append((vehicle, _FileDownload(path=path)))
        self._start_next(now)

    def cancel(self, reason: str) -> None:
        """End all requests."""
        cancelled = [download for _, download in self._queue]
        self._queue.clear()
        if self._download is not None and self._state != "closing":
            cancelled.insert(0, self._download)
        for download in cancelled:
            self._events.append(FileFailed(download.path, None, reason))
        self._state, self._download = "idle", None
        self._requests.clear()
        self._resend.stop()

    def receive(self, message: Message, now: float) -> None:
        """Take an answer; one without a request is ignored."""
        if message.get_type() != "FILE_TRANSFER_PROTOCOL" or self._download is None:
            return
        answer = FtpPacket.of(message)
        if not addressed_to(message, self._system, self._component) or answer.opcode not in {_ACK, _NAK}:
            return
        if self._state == "reading" and answer.req_opcode == _BURST:
            self._take_burst(self._download, answer, now)
            return
        if self._state == "reading" and (answer.opcode, answer.req_opcode) == (_ACK, _READ):
            self._take_part(self._download, answer, now)  # valid also if late: session and offset identify it
            return
        request = self._requests.get(answer.seq - 1 & 0xFFFF)
        if request is None or request.opcode != answer.req_opcode:
            return
        self._requests.pop(request.seq)
        if answer.opcode == _NAK:
            self._take_refusal(self._download, answer, now)
        else:
            self._take(self._download, answer, now)

    def next_deadline(self) -> float:
        """Link time at which a request must be repeated [s]."""
        return self._resend.deadline

    def handle_timer(self, now: float) -> None:
        """Repeat requests, or give up."""
        if now < self._resend.deadline or self._download is None:
            return
        if not self._resend.retry(now):
            self._give_up(self._download, None, "no answer", now)
            if self._state == "closing":  # sent once; the vehicle closes unused sessions itself
                self._end(None, now)
        elif self._state == "reading":
            self._request_missing(self._download)
        else:
            for request in self._requests.values():
                self._transmit(request)

    # Answers

    def _take(self, download: _FileDownload, answer: FtpPacket, now: float) -> None:
        self._resend.answer(now)
        self._resend.start(now)
        if self._state == "opening":
            self._take_opening(download, answer, now)
        else:
            self._end(None, now)

    def _take_opening(self, download: _FileDownload, answer: FtpPacket, now: float) -> None:
        size = int.from_bytes(answer.content[:4], "little")
        download.session = answer.session
        self._state = fire(FTP_CLIENT_TRANSITIONS, self._state, "opened")
        if size > MAX_FILE_SIZE:
            self._give_up(download, None, f"{size} bytes are too many", now)
            return
        download.data = bytearray(size)
        download.missing = set(range(math.ceil(size / MAX_DATA)))
        if size:
            self._request_missing(download)
        else:
            self._end(FileReceived(download.path, b""), now)

    def _take_burst(self, download: _FileDownload, answer: FtpPacket, now: float) -> None:
        if answer.session != download.session:
            return
        if answer.opcode == _NAK:
            if answer.error != _EOF:
                self._give_up(download, answer.error, enum_name("MAV_FTP_ERR", answer.error), now)
            return
        self._resend.answer(now)
        self._take_part(download, answer, now)
        if not 0 < answer.seq - self._burst & 0xFFFF < 0x8000:
            return  # of an earlier burst: its end is not the end of this one
        if answer.seq - self._seq & 0xFFFF < 0x8000:
            self._seq = answer.seq + 1 & 0xFFFF  # both ends continue from the larger number
        if answer.burst_complete and self._state == "reading":
            self._request_missing(download)

    def _take_part(self, download: _FileDownload, answer: FtpPacket, now: float) -> None:
        number, offset = answer.offset // MAX_DATA, answer.offset
        if answer.session != download.session or offset % MAX_DATA or number not in download.missing:
            return
        content = answer.content
        if len(content) != min(MAX_DATA, len(download.data) - offset):
            return
        download.data[offset : offset + len(content)] = content
        download.missing.discard(number)
        self._resend.wait(now)
        total = len(download.data)
        done = (math.ceil(total / MAX_DATA) - len(download.missing)) * MAX_DATA
        self._events.append(FileProgress(download.path, min(done, total), total))
        if not download.missing:
            self._end(FileReceived(download.path, bytes(download.data)), now)
        elif number in download.pending:
            download.pending.discard(number)
            if not download.pending:
                self._request_missing(download)

    def _take_refusal(self, download: _FileDownload, answer: FtpPacket, now: float) -> None:
        if self._state == "closing":
            self._end(None, now)
        else:
            self._give_up(download, answer.error, enum_name("MAV_FTP_ERR", answer.error), now)

    # Requests

    def _start_next(self, now: float) -> None:
        if self._download is not None or not self._queue:
            return
        self._vehicle, download = self._queue.popleft()
        self._download = download
        self._state = fire(FTP_CLIENT_TRANSITIONS, self._state, "read")
        self._session = self._session + 1 & 0xFF  # a new number: late answers to an older session do not match
        self._resend.start(now)
        path = download.path.encode("ascii")
        self._request(FtpPacket(seq=0, session=self._session, opcode=int(_OPEN), size=len(path), data=path))

    def _request_missing(self, download: _FileDownload) -> None:
        self._requests.clear()
        first = sorted(download.missing)[: MAX_OPEN_READS + 1]
        if len(first) > MAX_OPEN_READS:
            download.pending.clear()
            self._burst = self._seq
            self._request_data(_BURST, download, MAX_DATA, first[0])
            return
        download.pending = set(first)
        for number in first:
            self._request_data(_READ, download, min(MAX_DATA, len(download.data) - number * MAX_DATA), number)

    def _request_data(self, opcode: int, download: _FileDownload, size: int, number: int) -> None:
        offset = number * MAX_DATA
        self._request(FtpPacket(seq=0, session=download.session, opcode=int(opcode), size=size, offset=offset))

    def _request(self, packet: FtpPacket) -> None:
        request = packet._replace(seq=self._seq)
        self._seq = self._seq + 1 & 0xFFFF
        self._requests[request.seq] = request
        self._transmit(request)

    def _transmit(self, request: FtpPacket) -> None:
        self._out.append(request.to_message(*self._vehicle))

    # Ends

    def _give_up(self, download: _FileDownload, error: int | None, reason: str, now: float) -> None:
        failed = None if self._state == "closing" else FileFailed(download.path, error, reason)
        self._end(failed, now)

    def _end(self, event: FileReceived | FileFailed | None, now: float) -> None:
        session = self._download.session if self._download is not None else 0
        self._state = fire(FTP_CLIENT_TRANSITIONS, self._state, "end")
        self._requests.clear()
        if event is not None:
            self._events.append(event)
        if self._state == "closing":
            self._resend.start(now)
            self._request(FtpPacket(seq=0, session=session, opcode=int(_CLOSE)))
            return
        self._resend.stop()
        self._download = None
        self._start_next(now)
