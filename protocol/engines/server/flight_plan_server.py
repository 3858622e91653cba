"""The vehicle's side of flight plans: its table on request, what happened, and the pieces of a new plan's file.

The table has no transfer of its own: every request is answered by itself, so the vehicle remembers nothing of its
peers. DARKO_PLAN_STATUS, which is sent all the time, tells peers which plan it is, how many entries there are, and a
checksum of what can change in them.

One file at a time; another sender has to wait until the present one is whole or has been silent for a while.
"""

from __future__ import annotations

import math
import zlib
from collections import deque
from collections.abc import Sequence

from protocol.dialect import mavlink
from protocol.engines.base import REORDER_WINDOW, SILENCE_LIMIT, Server
from protocol.engines.server.replies import plan_file_ack
from protocol.engines.table_values import EVENTS_KEPT, PIECE_BYTES, changing_part, table_checksum
from protocol.events import FlightPlanUploaded
from protocol.ranges import MAX_PLAN_FILE
from protocol.wire.message import Message, Peer, addressed_to

MAX_COUNT = 0xFFFF  # of events; it goes on at 1


class FlightPlanServer(Server):
    """Holds the table of the plan that is loaded; without one it answers nothing."""

    handles = frozenset({"DARKO_PLAN_REQUEST"})

    def __init__(self, system: int, component: int) -> None:
        super().__init__()
        self._system, self._component = system, component
        self.plan_id = 0  # 0: no plan
        self._entries: dict[int, Message] = {}
        self._places: dict[tuple[str, int], int] = {}  # in the table, by kind and number
        self._happened: deque[Message] = deque(maxlen=EVENTS_KEPT)
        self._count = 0

    def load(self, entries: Sequence[Message]) -> None:
        """Replace the table.

        Args:
            entries: Of the new one; their place in it and the plan's id are filled in.
        """
        self._count = 0
        self._happened.clear()
        crc = 0
        for number, entry in enumerate(entries):
            entry.entry = number
            crc = zlib.crc32(_fixed_part(entry), crc)
        self.plan_id = crc or 1
        for entry in entries:
            entry.plan_id = self.plan_id
        self._entries = dict(enumerate(entries))
        self._places = {(entry.get_type(), entry.number): number for number, entry in self._entries.items()}

    def update(self, entries: Sequence[Message]) -> list[Message]:
        """Take entries of the table as they are now; gives those that have changed, to be sent to everyone."""
        changed = []
        for entry in entries:
            place = self._places[entry.get_type(), entry.number]
            entry.entry, entry.plan_id = place, self.plan_id
            if changing_part(entry) != changing_part(self._entries[place]):
                self._entries[place] = entry
                changed.append(entry)
        return changed

    def tell(self, event: Message) -> Message:
        """Number an event and keep it for those who miss it; it is to be sent to everyone."""
        self._count = self._count % MAX_COUNT + 1
        event.number, event.plan_id = self._count, self.plan_id
        self._happened.append(event)
        return event

    def mark(self, status: Message) -> None:
        """Complete an outgoing DARKO_PLAN_STATUS."""
        status.plan_id, status.entries, status.events = self.plan_id, len(self._entries), self._count
        status.checksum = table_checksum(self._entries)

    def receive(self, message: Message, now: float, peer: Peer) -> None:  # noqa: ARG002 - every request stands alone
        """Take a DARKO_PLAN_REQUEST; what does not exist is not answered."""
        if not addressed_to(message, self._system, self._component):
            return
        found = None
        if message.part == mavlink.DARKO_PLAN_PART_ENTRY:
            found = self._entries.get(message.number)
        elif message.part == mavlink.DARKO_PLAN_PART_EVENT:
            found = next((event for event in self._happened if event.number == message.number), None)
        if found is not None:
            self._reply(peer, found)


def _fixed_part(entry: Message) -> bytes:
    """The fields that identify an entry of any kind, as bytes."""
    fields = (entry.get_type(), entry.number, entry.name, getattr(entry, "corners", ""), getattr(entry, "locked", ""))
    return repr(fields).encode()


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
