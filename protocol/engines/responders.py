"""One question, one answer: TIMESYNC, PING, and polite refusals of what this vehicle has not.

Clients wait for seconds on silence, so logs and files are refused at once
(https://mavlink.io/en/services/timesync.html, ping.html, ftp.html, messages/common.html#LOG_REQUEST_LIST).
"""

from abc import abstractmethod
from collections.abc import Callable

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.base import Peer, Server, addressed_to

__all__ = ["Refuser", "TimeResponder"]

Handler = Callable[[Message, float, Peer], None]

_FTP_NAK, _FTP_UNKNOWN_COMMAND = 129, 7
_FTP_PAYLOAD = 251


class _Responder(Server):
    """Answers without a state, looked up by message type."""

    def __init__(self, system: int, component: int) -> None:
        super().__init__()
        self._system, self._component = system, component
        self._handlers = self._answers()
        self.handles = frozenset(self._handlers)

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Answer a question that is put to this component, or to all."""
        handler = self._handlers.get(message.get_type())
        if handler is not None and addressed_to(message, self._system, self._component):
            handler(message, now, peer)

    @abstractmethod
    def _answers(self) -> dict[str, Handler]: ...


class TimeResponder(_Responder):
    """TIMESYNC and PING."""

    def _answers(self) -> dict[str, Handler]:
        return {"TIMESYNC": self._handle_timesync, "PING": self._handle_ping}

    def _handle_timesync(self, message: Message, now: float, peer: Peer) -> None:
        if message.tc1 == 0:
            own = max(round(now * 1e9), 1)  # [ns]; 0 would make a question of the answer
            self._reply(peer, mavlink.MAVLink_timesync_message(tc1=own, ts1=message.ts1))

    def _handle_ping(self, message: Message, _now: float, peer: Peer) -> None:
        if message.target_system == 0 and message.target_component == 0:  # others are answers
            answer = mavlink.MAVLink_ping_message(message.time_usec, message.seq, peer.system, peer.component)
            self._reply(peer, answer)


class Refuser(_Responder):
    """There are no logs and no files here."""

    def _answers(self) -> dict[str, Handler]:
        return {"LOG_REQUEST_LIST": self._handle_logs, "FILE_TRANSFER_PROTOCOL": self._handle_files}

    def _handle_logs(self, _message: Message, _now: float, peer: Peer) -> None:
        none = mavlink.MAVLink_log_entry_message(id=0, num_logs=0, last_log_num=0, time_utc=0, size=0)
        self._reply(peer, none)

    def _handle_files(self, message: Message, _now: float, peer: Peer) -> None:
        asked = bytes(message.payload)
        number = (int.from_bytes(asked[:2], "little") + 1) & 0xFFFF
        head = number.to_bytes(2, "little") + bytes([asked[2], _FTP_NAK, 1, asked[3], 0, 0, 0, 0, 0, 0])
        payload = (head + bytes([_FTP_UNKNOWN_COMMAND])).ljust(_FTP_PAYLOAD, b"\0")
        answer = mavlink.MAVLink_file_transfer_protocol_message(0, peer.system, peer.component, list(payload))
        self._reply(peer, answer)
