"""MAVLink FTP from the asking side: listing, reading and checking files (https://mavlink.io/en/services/ftp.html).

A file is read by bursts. What a burst left out is read piece by piece when little is missing, by another burst
when much is. One operation runs at a time; further ones wait.
"""

import math
from collections import deque
from dataclasses import dataclass, field

from protocol.codec import Message, Source
from protocol.dialect import mavlink
from protocol.engines.base import Engine, Table, addressed_to, fire
from protocol.engines.ftp import DATA, Packet
from protocol.engines.retransmission import Partner, Resend
from protocol.errors import LocalProtocolError
from protocol.events import FileFailed, FileListed, FileProgress, FileReceived, FileSummed

__all__ = ["TRANSITIONS", "FtpClient"]

PIECES = 8  # pieces asked for at once
LARGEST = 1 << 28  # bytes a file may have
MOST_ENTRIES = 10_000  # of a folder

_ACK, _NAK = mavlink.MAV_FTP_OPCODE_ACK, mavlink.MAV_FTP_OPCODE_NAK
_LIST, _OPEN = mavlink.MAV_FTP_OPCODE_LISTDIRECTORY, mavlink.MAV_FTP_OPCODE_OPENFILERO
_READ, _BURST = mavlink.MAV_FTP_OPCODE_READFILE, mavlink.MAV_FTP_OPCODE_BURSTREADFILE
_CRC, _CLOSE = mavlink.MAV_FTP_OPCODE_CALCFILECRC, mavlink.MAV_FTP_OPCODE_TERMINATESESSION
_EOF = mavlink.MAV_FTP_ERR_EOF

TRANSITIONS: Table = {
    ("idle", "list"): "listing",
    ("idle", "read"): "opening",
    ("idle", "checksum"): "summing",
    ("listing", "end"): "idle",
    ("summing", "end"): "idle",
    ("opening", "end"): "idle",
    ("opening", "opened"): "reading",
    ("reading", "end"): "closing",
    ("closing", "end"): "idle",
}
_FIRST = {"list": _LIST, "read": _OPEN, "checksum": _CRC}


@dataclass(slots=True)
class _Operation:
    kind: str  # a trigger of TRANSITIONS
    path: str
    entries: list[tuple[str, int | None]] = field(default_factory=list)
    session: int = 0
    data: bytearray = field(default_factory=bytearray)
    missing: set[int] = field(default_factory=set)  # numbers of pieces
    pending: set[int] = field(default_factory=set)  # pieces asked for one by one


class FtpClient(Engine[Message]):
    """Works on the files of one vehicle at a time; every call ends in an event.

    Args:
        system: Own system id.
        component: Own component id.
        partner: The vehicle as all engines of this end know it.
    """

    def __init__(self, system: int, component: int, partner: Partner | None = None) -> None:
        super().__init__()
        self._system, self._component = system, component
        self._vehicle: Source = (0, 0)
        self._queue: deque[tuple[Source, _Operation]] = deque()
        self._state, self._resend = "idle", Resend(partner or Partner())
        self._operation: _Operation | None = None
        self._requests: dict[int, Packet] = {}  # by sequence number: what waits for an answer
        self._seq, self._session = 0, 0
        self._burst = 0  # sequence number of the newest burst request

    @property
    def is_busy(self) -> bool:
        """True while something is under way or waiting."""
        return self._operation is not None or bool(self._queue)

    def request_list(self, vehicle: Source, path: str, now: float) -> None:
        """Ask what a folder holds; ends in ``FileListed`` or ``FileFailed``. Raises LocalProtocolError."""
        self._begin(vehicle, _Operation("list", path), now)

    def read(self, vehicle: Source, path: str, now: float) -> None:
        """Download a file; ends in ``FileReceived`` or ``FileFailed``. Raises LocalProtocolError."""
        self._begin(vehicle, _Operation("read", path), now)

    def checksum(self, vehicle: Source, path: str, now: float) -> None:
        """Ask for a file's checksum; ends in ``FileSummed`` or ``FileFailed``. Raises LocalProtocolError."""
        self._begin(vehicle, _Operation("checksum", path), now)

    def cancel(self, reason: str) -> None:
        """Give up on everything."""
        doomed = [operation for _, operation in self._queue]
        self._queue.clear()
        if self._operation is not None and self._state != "closing":
            doomed.insert(0, self._operation)
        for operation in doomed:
            self._events.append(FileFailed(operation.path, None, reason))
        self._state, self._operation = "idle", None
        self._requests.clear()
        self._resend.stop()

    def receive(self, message: Message, now: float) -> None:
        """Take an answer; what answers nothing asked here is ignored."""
        if message.get_type() != "FILE_TRANSFER_PROTOCOL" or self._operation is None:
            return
        answer = Packet.of(message)
        if not addressed_to(message, self._system, self._component) or answer.opcode not in {_ACK, _NAK}:
            return
        if self._state == "reading" and answer.req_opcode == _BURST:
            self._take_burst(self._operation, answer, now)
            return
        if self._state == "reading" and (answer.opcode, answer.req_opcode) == (_ACK, _READ):
            self._take_piece(self._operation, answer, now)  # also late: session and offset say what it is
            return
        request = self._requests.get(answer.seq - 1 & 0xFFFF)
        if request is None or request.opcode != answer.req_opcode:
            return
        self._requests.pop(request.seq)
        if answer.opcode == _NAK:
            self._take_refusal(self._operation, answer, now)
        else:
            self._take(self._operation, answer, now)

    def next_deadline(self) -> float:
        """When something must be asked for again."""
        return self._resend.deadline

    def handle_timer(self, now: float) -> None:
        """Ask again, or give up."""
        if now < self._resend.deadline or self._operation is None:
            return
        if not self._resend.retry(now):
            self._give_up(self._operation, None, "no answer", now)
            if self._state == "closing":  # said once; the vehicle closes by itself what nobody uses
                self._end(None, now)
        elif self._state == "reading":
            self._ask_for_missing(self._operation)
        else:
            for request in self._requests.values():
                self._transmit(request)

    # Answers

    def _take(self, operation: _Operation, answer: Packet, now: float) -> None:
        self._resend.answer(now)
        self._resend.start(now)
        if self._state == "listing":
            operation.entries += _entries(answer.content)
            if len(operation.entries) > MOST_ENTRIES:
                self._give_up(operation, None, "the listing does not end", now)
                return
            self._request(Packet(0, 0, int(_LIST), offset=len(operation.entries)), operation.path)
        elif self._state == "opening":
            self._take_opening(operation, answer, now)
        elif self._state == "summing":
            self._end(FileSummed(operation.path, int.from_bytes(answer.content[:4], "little")), now)
        else:
            self._end(None, now)

    def _take_opening(self, operation: _Operation, answer: Packet, now: float) -> None:
        size = int.from_bytes(answer.content[:4], "little")
        operation.session = answer.session
        self._state = fire(TRANSITIONS, self._state, "opened")
        if size > LARGEST:
            self._give_up(operation, None, f"{size} bytes are too many", now)
            return
        operation.data = bytearray(size)
        operation.missing = set(range(math.ceil(size / DATA)))
        if size:
            self._ask_for_missing(operation)
        else:
            self._end(FileReceived(operation.path, b""), now)

    def _take_burst(self, operation: _Operation, answer: Packet, now: float) -> None:
        if answer.session != operation.session:
            return
        if answer.opcode == _NAK:
            if answer.error != _EOF:
                self._give_up(operation, answer.error, _error_name(answer.error), now)
            return
        self._resend.answer(now)
        self._take_piece(operation, answer, now)
        if not 0 < answer.seq - self._burst & 0xFFFF < 0x8000:
            return  # late from an earlier burst: its end is not the end of this one
        if answer.seq - self._seq & 0xFFFF < 0x8000:
            self._seq = answer.seq + 1 & 0xFFFF  # both ends count on
        if answer.burst_complete and self._state == "reading":
            self._ask_for_missing(operation)

    def _take_piece(self, operation: _Operation, answer: Packet, now: float) -> None:
        number, offset = answer.offset // DATA, answer.offset
        if answer.session != operation.session or offset % DATA or number not in operation.missing:
            return
        content = answer.content
        if len(content) != min(DATA, len(operation.data) - offset):
            return
        operation.data[offset : offset + len(content)] = content
        operation.missing.discard(number)
        self._resend.wait(now)
        total = len(operation.data)
        done = (math.ceil(total / DATA) - len(operation.missing)) * DATA
        self._events.append(FileProgress(operation.path, min(done, total), total))
        if not operation.missing:
            self._end(FileReceived(operation.path, bytes(operation.data)), now)
        elif number in operation.pending:
            operation.pending.discard(number)
            if not operation.pending:
                self._ask_for_missing(operation)

    def _take_refusal(self, operation: _Operation, answer: Packet, now: float) -> None:
        if self._state == "listing" and answer.error == _EOF:
            self._end(FileListed(operation.path, tuple(operation.entries)), now)
        elif self._state == "closing":
            self._end(None, now)
        else:
            self._give_up(operation, answer.error, _error_name(answer.error), now)

    # Requests

    def _begin(self, vehicle: Source, operation: _Operation, now: float) -> None:
        if not (operation.path.isascii() and len(operation.path) <= DATA and "\0" not in operation.path):
            raise LocalProtocolError(f"path {operation.path!r} is not at most {DATA} ASCII characters")
        self._queue.append((vehicle, operation))
        self._go_on(now)

    def _go_on(self, now: float) -> None:
        if self._operation is not None or not self._queue:
            return
        self._vehicle, operation = self._queue.popleft()
        self._operation = operation
        self._state = fire(TRANSITIONS, self._state, operation.kind)
        self._session = self._session + 1 & 0xFF  # a new number: late answers to an older one cannot be meant
        self._resend.start(now)
        self._request(Packet(0, self._session, int(_FIRST[operation.kind])), operation.path)

    def _ask_for_missing(self, operation: _Operation) -> None:
        self._requests.clear()
        first = sorted(operation.missing)[: PIECES + 1]
        if len(first) > PIECES:
            operation.pending.clear()
            self._burst = self._seq
            self._request(Packet(0, operation.session, int(_BURST), DATA, offset=first[0] * DATA))
            return
        operation.pending = set(first)
        for number in first:
            size = min(DATA, len(operation.data) - number * DATA)
            self._request(Packet(0, operation.session, int(_READ), size, offset=number * DATA))

    def _request(self, packet: Packet, path: str = "") -> None:
        request = packet._replace(seq=self._seq)
        if path:
            request = request._replace(size=len(path), data=path.encode("ascii"))
        self._seq = self._seq + 1 & 0xFFFF
        self._requests[request.seq] = request
        self._transmit(request)

    def _transmit(self, request: Packet) -> None:
        self._out.append(request.to_message(*self._vehicle))

    # Ends

    def _give_up(self, operation: _Operation, error: int | None, reason: str, now: float) -> None:
        failed = None if self._state == "closing" else FileFailed(operation.path, error, reason)
        self._end(failed, now)

    def _end(self, event: FileListed | FileReceived | FileSummed | FileFailed | None, now: float) -> None:
        session = self._operation.session if self._operation is not None else 0
        self._state = fire(TRANSITIONS, self._state, "end")
        self._requests.clear()
        if event is not None:
            self._events.append(event)
        if self._state == "closing":
            self._resend.start(now)
            self._request(Packet(0, session, int(_CLOSE)))
            return
        self._resend.stop()
        self._operation = None
        self._go_on(now)


def _entries(data: bytes) -> list[tuple[str, int | None]]:
    """Lines of a listing; one that cannot be read keeps its place in the numbering, with its whole text."""
    entries: list[tuple[str, int | None]] = []
    for line in data.split(b"\0"):
        text = line.decode("ascii", errors="replace")
        name, _, size = text[1:].partition("\t")
        if text:
            entries.append((name, int(size) if text[0] == "F" and size.isdecimal() else None))
    return entries


def _error_name(error: int) -> str:
    entry = mavlink.enums["MAV_FTP_ERR"].get(error)
    return entry.name.removeprefix("MAV_FTP_ERR_") if entry else f"MAV_FTP_ERR {error}"
