"""The vehicle's side of flight plans: its table, entry by entry on request, and what happened.

The table has no transfer of its own: every request is answered by itself, so the vehicle remembers nothing of its
peers. DARKO_PLAN_STATUS, which is sent all the time, tells peers which plan it is, how many entries there are, and a
checksum of what can change in them.
"""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Sequence

from protocol.dialect import mavlink
from protocol.engines.base import Server
from protocol.engines.flight_plan_table import EVENTS_KEPT, changing_part, table_checksum
from protocol.wire.message import Message, Peer, addressed_to

__all__ = ["FlightPlanServer"]

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
