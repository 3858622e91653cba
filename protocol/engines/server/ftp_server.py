"""Lets peers list and read files by MAVLink FTP (https://mavlink.io/en/services/ftp.html).

A session gets the number its client asks for, so that a client can have several, or another one if that is in use.
Repeated reads and listings are executed again. A repeated request that opens or closes sessions must not be executed
twice: it gets the stored answer of the first one.
"""

from __future__ import annotations

import math
from collections import OrderedDict, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from protocol.dialect import mavlink
from protocol.engines.base import Server
from protocol.engines.file_transfer import MAX_DATA, Entry, File, FileTree, FtpPacket, crc32
from protocol.ranges import MESSAGES_PER_INTERVAL, SEND_INTERVAL
from protocol.wire.message import Message, Peer, addressed_to

MAX_SESSIONS = 16  # open at once
MAX_SESSIONS_PER_PEER = 6
MAX_CHECKSUMS = 4  # being computed at once
SESSION_TIMEOUT = 15.0  # [s] after which an unused session is closed
RESTART_TIME = 3.0  # [s] without use: a client that opens the same number again has been restarted
REPEAT_WINDOW = 5.0  # [s] in which the same request is a repetition
MAX_ANSWERED_PEERS = 32  # whose answers are stored
MAX_STORED_ANSWERS = 8  # of each peer
MAX_BURST = 200  # messages in one burst
CHECKSUM_SLICE = 1 << 16  # [bytes] of a checksum computed in one interval

_ACK, _NAK = mavlink.MAV_FTP_OPCODE_ACK, mavlink.MAV_FTP_OPCODE_NAK
_OPEN, _BURST_READ = mavlink.MAV_FTP_OPCODE_OPENFILERO, mavlink.MAV_FTP_OPCODE_BURSTREADFILE
_TERMINATE, _RESET = mavlink.MAV_FTP_OPCODE_TERMINATESESSION, mavlink.MAV_FTP_OPCODE_RESETSESSION
_NOT_REPEATABLE = frozenset({_OPEN, _TERMINATE, _RESET})
_WRITING = frozenset(
    {
        mavlink.MAV_FTP_OPCODE_CREATEFILE,
        mavlink.MAV_FTP_OPCODE_WRITEFILE,
        mavlink.MAV_FTP_OPCODE_REMOVEFILE,
        mavlink.MAV_FTP_OPCODE_CREATEDIRECTORY,
        mavlink.MAV_FTP_OPCODE_REMOVEDIRECTORY,
        mavlink.MAV_FTP_OPCODE_OPENFILEWO,
        mavlink.MAV_FTP_OPCODE_TRUNCATEFILE,
        mavlink.MAV_FTP_OPCODE_RENAME,
    }
)


class _RefusedError(Exception):
    """A request that is answered with a NAK with this MAV_FTP_ERR."""

    def __init__(self, error: int) -> None:
        super().__init__()
        self.data = bytes([error])


@dataclass(slots=True)
class _Burst:
    request: FtpPacket
    seq: int
    offset: int
    left: int = MAX_BURST


@dataclass(slots=True)
class _Session:
    file: File
    heard: float
    burst: _Burst | None = None


@dataclass(slots=True, kw_only=True)
class _Checksum:
    peer: Peer
    request: FtpPacket
    file: File
    offset: int = 0
    crc: int = 0


@dataclass(slots=True)
class _Answered:
    request: FtpPacket
    at: float
    reply: Message


class FtpServer(Server):
    """Serves a tree of files; requests that would change it are refused with FileProtected.

    Args:
        system: Own system id.
        component: Own component id.
        tree: The files.
    """

    handles = frozenset({"FILE_TRANSFER_PROTOCOL"})

    def __init__(self, system: int, component: int, tree: FileTree) -> None:
        super().__init__()
        self._system, self._component, self._tree = system, component, tree
        self._sessions: dict[tuple[Peer, int], _Session] = {}
        self._checksums: list[_Checksum] = []
        self._answered: OrderedDict[Peer, deque[_Answered]] = OrderedDict()
        self._deadline = math.inf
        self._handlers: Mapping[int, Callable[[FtpPacket, float, Peer], FtpPacket | None]] = {
            mavlink.MAV_FTP_OPCODE_NONE: self._acknowledge,
            _TERMINATE: self._terminate,
            _RESET: self._reset,
            mavlink.MAV_FTP_OPCODE_LISTDIRECTORY: self._list,
            _OPEN: self._open,
            mavlink.MAV_FTP_OPCODE_READFILE: self._read,
            mavlink.MAV_FTP_OPCODE_CALCFILECRC: self._begin_checksum,
            _BURST_READ: self._begin_burst,
        } | dict.fromkeys(_WRITING, self._refuse_writing)

    @property
    def sessions(self) -> int:
        """Number of open sessions."""
        return len(self._sessions)

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take a FILE_TRANSFER_PROTOCOL request; answers are ignored."""
        if message.get_type() not in self.handles or not addressed_to(message, self._system, self._component):
            return
        request = FtpPacket.of(message)
        if request.opcode in {_ACK, _NAK}:
            return
        self._expire(now)
        earlier = self._earlier_answer(request, now, peer)
        if earlier is not None:
            self._reply(peer, earlier)
            return
        reply = self._serve(request, now, peer)
        if reply is not None:
            answer = reply.to_message(peer.system, peer.component)
            self._reply(peer, answer)
            if request.opcode in _NOT_REPEATABLE and reply.opcode == _ACK:
                self._remember(request, now, peer, answer)

    def next_deadline(self) -> float:
        """Link time at which the next part of a burst or a checksum is due, or a session times out [s]."""
        return min([self._deadline, *(session.heard + SESSION_TIMEOUT for session in self._sessions.values())])

    def handle_timer(self, now: float) -> None:
        """Send the next part of every burst, continue checksums, close unused sessions."""
        self._expire(now)
        if now < self._deadline:
            return
        for checksum in list(self._checksums):
            self._continue_checksum(checksum)
        bursting = [(key, session) for key, session in self._sessions.items() if session.burst is not None]
        for at in range(MESSAGES_PER_INTERVAL if bursting else 0):
            (peer, number), session = bursting[at % len(bursting)]
            self._continue_burst(peer, number, session, now)
        self._pace(now)

    # Requests with one answer

    def _serve(self, request: FtpPacket, now: float, peer: Peer) -> FtpPacket | None:
        handler = self._handlers.get(request.opcode)
        if handler is None:
            return _nak(request, bytes([mavlink.MAV_FTP_ERR_UNKNOWNCOMMAND]))
        if request.size > MAX_DATA:
            return _nak(request, bytes([mavlink.MAV_FTP_ERR_INVALIDDATASIZE]))
        try:
            return handler(request, now, peer)
        except _RefusedError as refused:
            return _nak(request, refused.data)
        except FileNotFoundError:
            return _nak(request, bytes([mavlink.MAV_FTP_ERR_FILENOTFOUND]))
        except (IsADirectoryError, NotADirectoryError):
            return _nak(request, bytes([mavlink.MAV_FTP_ERR_FAIL]))
        except OSError as error:
            return _nak(request, _errno(error))

    def _acknowledge(self, request: FtpPacket, _now: float, _peer: Peer) -> FtpPacket:
        return _ack(request)

    def _refuse_writing(self, request: FtpPacket, now: float, peer: Peer) -> FtpPacket:
        if request.opcode == mavlink.MAV_FTP_OPCODE_WRITEFILE:
            self._session(request, now, peer)
        raise _RefusedError(mavlink.MAV_FTP_ERR_FILEPROTECTED)

    def _list(self, request: FtpPacket, _now: float, _peer: Peer) -> FtpPacket:
        entries = self._tree.entries(request.path)
        if request.offset >= len(entries):
            raise _RefusedError(mavlink.MAV_FTP_ERR_EOF)
        data = b""
        for entry in entries[request.offset :]:
            line = _line(entry)
            if len(data) + len(line) > MAX_DATA:
                break
            data += line
        return _ack(request, data)

    def _open(self, request: FtpPacket, now: float, peer: Peer) -> FtpPacket:
        number = self._free_number(request.session, now, peer)
        file = self._tree.open(request.path)
        self._sessions[peer, number] = _Session(file, now)
        return _ack(request, file.size.to_bytes(4, "little"))._replace(session=number)

    def _free_number(self, wanted: int, now: float, peer: Peer) -> int:
        session = self._sessions.get((peer, wanted))
        if session is not None and session.burst is None and now - session.heard >= RESTART_TIME:
            self._close(peer, wanted)
        own = {number for owner, number in self._sessions if owner == peer}
        if len(self._sessions) >= MAX_SESSIONS or len(own) >= MAX_SESSIONS_PER_PEER:
            raise _RefusedError(mavlink.MAV_FTP_ERR_NOSESSIONSAVAILABLE)
        return wanted if wanted not in own else next(n for n in range(256) if n not in own)

    def _read(self, request: FtpPacket, now: float, peer: Peer) -> FtpPacket:
        session = self._session(request, now, peer)
        if request.size == 0:
            raise _RefusedError(mavlink.MAV_FTP_ERR_INVALIDDATASIZE)
        if request.offset >= session.file.size:
            raise _RefusedError(mavlink.MAV_FTP_ERR_EOF)
        return _ack(request, _portion(session.file, request.offset, request.size))

    def _terminate(self, request: FtpPacket, now: float, peer: Peer) -> FtpPacket:
        self._session(request, now, peer)
        self._close(peer, request.session)
        self._answered.pop(peer, None)  # the answer to an earlier opening is no longer valid
        return _ack(request)

    def _reset(self, request: FtpPacket, _now: float, peer: Peer) -> FtpPacket:
        for owner, number in [key for key in self._sessions if key[0] == peer]:  # other peers keep theirs
            self._close(owner, number)
        self._answered.pop(peer, None)
        return _ack(request)

    # Bursts and checksums

    def _begin_burst(self, request: FtpPacket, now: float, peer: Peer) -> None:
        session = self._session(request, now, peer)
        if request.offset >= session.file.size:
            raise _RefusedError(mavlink.MAV_FTP_ERR_EOF)
        session.burst = _Burst(request, request.seq, request.offset)
        self._pace(now)

    def _continue_burst(self, peer: Peer, number: int, session: _Session, now: float) -> None:
        burst = session.burst
        if burst is None:
            return
        session.heard = now
        try:
            data = _portion(session.file, burst.offset, burst.request.size or MAX_DATA)
        except OSError as error:
            session.burst = None
            self._reply(peer, _nak(burst.request, _errno(error)).to_message(peer.system, peer.component))
            return
        burst.left -= 1
        ended = burst.left == 0 or burst.offset + len(data) >= session.file.size
        packet = _ack(burst.request._replace(seq=burst.seq, session=number, offset=burst.offset), data)
        complete = packet._replace(burst_complete=int(ended))
        self._reply(peer, complete.to_message(peer.system, peer.component))
        burst.seq, burst.offset = burst.seq + 1 & 0xFFFF, burst.offset + len(data)
        if ended:
            session.burst = None

    def _begin_checksum(self, request: FtpPacket, now: float, peer: Peer) -> None:
        if any(c.peer == peer and c.request == request for c in self._checksums):
            return  # its answer will follow
        if len(self._checksums) >= MAX_CHECKSUMS:
            raise _RefusedError(mavlink.MAV_FTP_ERR_NOSESSIONSAVAILABLE)
        self._checksums.append(_Checksum(peer=peer, request=request, file=self._tree.open(request.path)))
        self._pace(now)

    def _continue_checksum(self, work: _Checksum) -> None:
        try:
            data = work.file.read(work.offset, min(CHECKSUM_SLICE, work.file.size - work.offset))
            work.crc, work.offset = crc32(data, work.crc), work.offset + len(data)
            reply = _ack(work.request, work.crc.to_bytes(4, "little"))
            ended = not data or work.offset >= work.file.size
        except OSError as error:
            reply = _nak(work.request, _errno(error))
            ended = True
        if ended:
            work.file.close()
            self._checksums.remove(work)
            self._reply(work.peer, reply.to_message(work.peer.system, work.peer.component))

    def _pace(self, now: float) -> None:
        busy = self._checksums or any(session.burst is not None for session in self._sessions.values())
        if not busy:
            self._deadline = math.inf
        elif self._deadline <= now or math.isinf(self._deadline):
            self._deadline = now + SEND_INTERVAL

    # Sessions

    def _session(self, request: FtpPacket, now: float, peer: Peer) -> _Session:
        session = self._sessions.get((peer, request.session))
        if session is None:
            raise _RefusedError(mavlink.MAV_FTP_ERR_INVALIDSESSION)
        session.heard = now
        return session

    def _close(self, peer: Peer, number: int) -> None:
        self._sessions.pop((peer, number)).file.close()

    def _expire(self, now: float) -> None:
        for key in [key for key, session in self._sessions.items() if now - session.heard >= SESSION_TIMEOUT]:
            self._close(*key)

    # Repetitions

    def _earlier_answer(self, request: FtpPacket, now: float, peer: Peer) -> Message | None:
        for answered in self._answered.get(peer, ()):
            if answered.request == request and now - answered.at < REPEAT_WINDOW:
                return answered.reply
        return None

    def _remember(self, request: FtpPacket, now: float, peer: Peer, reply: Message) -> None:
        self._answered.setdefault(peer, deque(maxlen=MAX_STORED_ANSWERS)).append(_Answered(request, now, reply))
        self._answered.move_to_end(peer)
        if len(self._answered) > MAX_ANSWERED_PEERS:
            self._answered.popitem(last=False)


def _portion(file: File, offset: int, size: int) -> bytes:
    """Bytes of a file, which must be as long as when it was opened."""
    data = file.read(offset, min(size, MAX_DATA, file.size - offset))
    if not data:
        raise OSError(5, "the file became shorter")
    return data


def _line(entry: Entry) -> bytes:
    text = f"D{entry.name}" if entry.size is None else f"F{entry.name}\t{entry.size}"
    return text.encode("ascii", errors="replace")[: MAX_DATA - 1] + b"\0"


def _errno(error: OSError) -> bytes:
    return bytes([mavlink.MAV_FTP_ERR_FAILERRNO, (error.errno or 0) & 0xFF])


def _ack(request: FtpPacket, data: bytes = b"") -> FtpPacket:
    seq = request.seq + 1 & 0xFFFF
    return FtpPacket(
        seq=seq,
        session=request.session,
        opcode=int(_ACK),
        size=len(data),
        req_opcode=request.opcode,
        offset=request.offset,
        data=data,
    )


def _nak(request: FtpPacket, data: bytes) -> FtpPacket:
    return _ack(request, data)._replace(opcode=int(_NAK))
