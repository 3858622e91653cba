"""The ground station's side of flight plans: downloads the table, and again whatever it has missed.

DARKO_PLAN_STATUS starts everything: with another plan, all entries are requested, several at a time; with another
checksum than that of the entries held, those that can change are requested again; with a larger count of events, the
events that did not arrive.
"""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.engines.base import Engine
from protocol.engines.flight_plan_table import (
    EVENTS_KEPT,
    MAX_ENTRIES,
    TABLE_MESSAGES,
    changing_part,
    table_checksum,
)
from protocol.engines.retransmission import INITIAL_TIMEOUT, STALL_LIMIT, Remote, RequestWindow
from protocol.events import FlightPlanFailed, FlightPlanReceived
from protocol.wire.message import Message, Source, source_of, target_fields

__all__ = ["FlightPlanClient"]

MAX_OPEN_ENTRY_REQUESTS = 10  # entries requested at a time
MAX_MISMATCHES = 2  # statuses in a row with another checksum, before the entries are requested again


class FlightPlanClient(Engine[Message]):
    """Keeps the table of the vehicle's flight plan complete.

    Args:
        remote: The vehicle's timing, shared by all engines of this end.
    """

    def __init__(self, remote: Remote | None = None) -> None:
        super().__init__()
        self._remote = remote or Remote()
        self._vehicle: Source = (0, 0)
        self._forget()

    def _forget(self) -> None:
        self._plan: tuple[int, int] | None = None  # id and number of entries
        self._held: dict[int, Message] = {}
        self._window: RequestWindow | None = None
        self._is_complete = False
        self._mismatches = 0
        self._rest_until = -math.inf  # after a failure nothing is requested [s]
        self._heard: set[int] = set()  # numbers of events
        self._asked: dict[int, float] = {}  # events asked for, and when

    @property
    def is_busy(self) -> bool:
        """True until the table of a plan has arrived for the first time."""
        return self._window is not None and not self._is_complete

    def request_again(self) -> None:
        """Download all of the table anew, with the next status."""
        self._forget()

    def cancel(self, _reason: str) -> None:
        """Forget all: the vehicle has restarted or is another one; the next status begins anew."""
        self._forget()

    def receive(self, message: Message, now: float) -> None:
        """Take a DARKO_PLAN_* message."""
        kind = message.get_type()
        if kind == "DARKO_PLAN_STATUS":
            self._follow(message, now)
        elif kind in TABLE_MESSAGES:
            self._take(message, now)
        elif kind == "DARKO_PLAN_EVENT" and self._plan is not None and message.plan_id == self._plan[0]:
            self._heard.add(message.number)
            self._asked.pop(message.number, None)

    def next_deadline(self) -> float:
        """Link time at which an entry must be requested again [s]."""
        return math.inf if self._window is None else self._window.deadline

    def handle_timer(self, now: float) -> None:
        """Request entries again, or give up."""
        if self._window is None or now < self._window.deadline:
            return
        if self._window.is_over(now):
            self._events.append(FlightPlanFailed(f"{len(self._window.missing)} entries missing"))
            self._forget()
            self._rest_until = now + STALL_LIMIT
        else:
            self._ask(self._window, now)

    def _follow(self, status: Message, now: float) -> None:
        self._vehicle = source_of(status)
        plan = (status.plan_id, status.entries)
        if now < self._rest_until or not 0 < status.entries <= MAX_ENTRIES:
            return
        if plan != self._plan:
            self._forget()
            self._plan = plan
            self._open(range(status.entries), now)
        elif self._window is None:
            self._compare(status, now)
        self._ask_for_events(status.events, now)

    def _compare(self, status: Message, now: float) -> None:
        """Two statuses in a row: one may only have overtaken the entry that changed."""
        is_same = status.checksum == table_checksum(self._held)
        self._mismatches = 0 if is_same else self._mismatches + 1
        if self._mismatches >= MAX_MISMATCHES:
            self._mismatches = 0
            self._open([number for number, entry in self._held.items() if changing_part(entry)], now)

    def _open(self, numbers: range | list[int], now: float) -> None:
        if numbers:
            self._window = RequestWindow(self._remote, numbers, MAX_OPEN_ENTRY_REQUESTS, now)
            self._ask(self._window, now)

    def _ask(self, window: RequestWindow, now: float) -> None:
        for number in window.ask(now):
            self._request(mavlink.DARKO_PLAN_PART_ENTRY, number)

    def _take(self, entry: Message, now: float) -> None:
        if self._plan is None or entry.plan_id != self._plan[0] or entry.entry >= self._plan[1]:
            return
        self._held[entry.entry] = entry
        window = self._window
        if window is None or not window.take(entry.entry, now):
            return
        if window.missing:
            self._ask(window, now)
        else:
            self._window = None
            if not self._is_complete:
                self._is_complete = True
                self._events.append(FlightPlanReceived(self._plan[0], self._plan[1]))

    def _ask_for_events(self, count: int, now: float) -> None:
        if self._heard and max(self._heard) > count:  # the vehicle counts anew
            self._heard.clear()
        newest = range(max(1, count - EVENTS_KEPT + 1), count + 1)
        self._heard.intersection_update(newest)
        self._asked = {number: at for number, at in self._asked.items() if number in newest}
        for number in newest:
            if number not in self._heard and now - self._asked.get(number, -math.inf) >= INITIAL_TIMEOUT:
                self._asked[number] = now
                self._request(mavlink.DARKO_PLAN_PART_EVENT, number)

    def _request(self, part: int, number: int) -> None:
        self._out.append(
            mavlink.MAVLink_darko_plan_request_message(**target_fields(self._vehicle), number=number, part=part)
        )
