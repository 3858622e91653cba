"""The vehicle's side of loading a flight plan: pieces of its file, in any order, until it is whole.

One file at a time; another sender has to wait until the present one is whole or has been silent for a while.
"""

from __future__ import annotations

import math
import zlib

from protocol.dialect import mavlink
from protocol.engines.base import Server
from protocol.engines.flight_plan_table import PIECE_BYTES
from protocol.engines.retransmission import REORDER_WINDOW, SILENCE_LIMIT
from protocol.engines.server.replies import plan_file_ack
from protocol.events import FlightPlanUploaded
from protocol.limits import MAX_PLAN_FILE
from protocol.wire.message import Message, Peer, addressed_to

__all__ = ["FlightPlanFileServer"]

_IN_PROGRESS = int(mavlink.MAV_RESULT_IN_PROGRESS)


class FlightPlanFileServer(Server):
    """Puts files together; the last one's answer is kept for repetitions."""

    handles = frozenset({"DARKO_PLAN_FILE"})

    def __init__(self, system: int, component: int) -> None:
        super().__init__()
        self._system, self._component = system, component
        self._key: tuple[int, int, int, int] | None = None  # sender, size and checksum of the present or last file
        self._pieces: dict[int, bytes] = {}  # by offset
        self._heard = -math.inf  # when its last piece came [s]
        self._answer = (_IN_PROGRESS, b"")

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take a DARKO_PLAN_FILE; a piece that cannot belong to a file is not answered."""
        if not addressed_to(message, self._system, self._component) or not _is_piece(message):
            return
        key = (*peer[:2], message.size, message.crc)
        is_judged = self._answer[0] != _IN_PROGRESS
        if key != self._key or (is_judged and now - self._heard > REORDER_WINDOW):  # later, it is sent once more
            if not is_judged and now - self._heard < SILENCE_LIMIT and self._is_of_another(peer):
                text = b"another ground station is loading a flight plan"
                self._acknowledge(message, peer, int(mavlink.MAV_RESULT_TEMPORARILY_REJECTED), text)
                return
            self._key, self._pieces, self._answer = key, {}, (_IN_PROGRESS, b"")
        self._heard = now
        if self._answer[0] == _IN_PROGRESS and self._takes_last(message, peer):
            return  # the answer to the last piece is the answer to the file
        self._acknowledge(message, peer, *self._answer)

    def answer(self, peer: Peer, result: int, text: bytes = b"") -> None:
        """Say what became of a ``FlightPlanUploaded``: a MAV_RESULT, and why it is refused."""
        if self._key is None or self._key[:2] != peer[:2]:
            return
        self._answer = (result, text)
        self._reply(peer, plan_file_ack(peer, self._key[3], 0, result, text))

    def _is_of_another(self, peer: Peer) -> bool:
        return self._key is not None and self._key[:2] != peer[:2]

    def _takes_last(self, message: Message, peer: Peer) -> bool:
        self._pieces[message.offset] = bytes(message.data[: message.count])
        if len(self._pieces) < math.ceil(message.size / PIECE_BYTES):
            return False
        data = b"".join(self._pieces[offset] for offset in sorted(self._pieces))
        self._pieces = {}
        if zlib.crc32(data) != message.crc:
            self._answer = (int(mavlink.MAV_RESULT_FAILED), b"the file arrived damaged")
            return False
        self._events.append(FlightPlanUploaded(data, peer))
        return True

    def _acknowledge(self, message: Message, peer: Peer, result: int, text: bytes) -> None:
        self._reply(peer, plan_file_ack(peer, message.crc, message.offset, result, text))


def _is_piece(message: Message) -> bool:
    """Whether a piece is whole and lies within a file that is not too large."""
    left = message.size - message.offset
    whole = message.offset % PIECE_BYTES == 0 and message.count == min(left, PIECE_BYTES)
    return bool(0 < message.size <= MAX_PLAN_FILE and left > 0 and whole)
