"""The ground station's side of flight plans: downloads the table, and sends the file of a new plan.

DARKO_PLAN_STATUS starts everything: with another plan, all entries are requested, several at a time; with another
checksum than that of the entries held, those that can change are requested again; with a larger count of events, the
events that did not arrive.
"""

from __future__ import annotations

import math
import zlib

from protocol.dialect import mavlink
from protocol.engines.base import INITIAL_TIMEOUT, STALL_LIMIT, Engine, Remote, RequestWindow
from protocol.engines.table_values import (
    EVENTS_KEPT,
    MAX_ENTRIES,
    PIECE_BYTES,
    TABLE_MESSAGES,
    changing_part,
    table_checksum,
)
from protocol.errors import LocalProtocolError
from protocol.events import FlightPlanAnswered, FlightPlanFailed, FlightPlanReceived
from protocol.ranges import MAX_PLAN_FILE
from protocol.wire.message import Message, Source, addressed_to, source_of, target_fields

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


MAX_OPEN_PIECES = 10  # sent and not yet answered


class FlightPlanUpload(Engine[Message]):
    """Sends one file at a time.

    Args:
        system: Own system id.
        component: Own component id.
        remote: The vehicle's timing, shared by all engines of this end.
    """

    def __init__(self, system: int, component: int, remote: Remote | None = None) -> None:
        super().__init__()
        self._system, self._component, self._remote = system, component, remote or Remote()
        self._vehicle: Source = (0, 0)
        self._data, self._crc = b"", 0
        self._window: RequestWindow | None = None  # pieces to send

    @property
    def is_busy(self) -> bool:
        """True while a file is being sent."""
        return self._window is not None

    def send(self, vehicle: Source, data: bytes, now: float) -> None:
        """Send a file; ends in ``FlightPlanAnswered``.

        Raises:
            LocalProtocolError: Another file is being sent, or this one is empty or too large.
        """
        if self._window is not None:
            raise LocalProtocolError("a flight plan is being sent already")
        if not 0 < len(data) <= MAX_PLAN_FILE:
            raise LocalProtocolError(f"the flight plan has {len(data)} bytes; the maximum is {MAX_PLAN_FILE}")
        self._vehicle, self._data, self._crc = vehicle, data, zlib.crc32(data)
        self._open(now)

    def cancel(self, reason: str) -> None:
        """Stop sending."""
        if self._window is not None:
            self._finish(reason)

    def receive(self, message: Message, now: float) -> None:
        """Take a DARKO_PLAN_FILE_ACK; one about another file is ignored."""
        window = self._window
        if message.get_type() != "DARKO_PLAN_FILE_ACK" or window is None or message.crc != self._crc:
            return
        if not addressed_to(message, self._system, self._component):
            return
        if message.result == mavlink.MAV_RESULT_ACCEPTED:
            self._finish("")
        elif message.result != mavlink.MAV_RESULT_IN_PROGRESS:
            self._finish(message.text or "refused")
        else:
            window.take(message.offset // PIECE_BYTES, now)
            if window.missing:
                self._transmit(window, now)
            else:  # all were taken, but not all are there: the vehicle began anew
                self._open(now)

    def next_deadline(self) -> float:
        """Link time at which a piece must be sent again [s]."""
        return math.inf if self._window is None else self._window.deadline

    def handle_timer(self, now: float) -> None:
        """Send pieces again, or give up."""
        if self._window is None or now < self._window.deadline:
            return
        if self._window.is_over(now):
            self._finish("no answer")
        else:
            self._transmit(self._window, now)

    def _open(self, now: float) -> None:
        pieces = range(math.ceil(len(self._data) / PIECE_BYTES))
        self._window = RequestWindow(self._remote, pieces, MAX_OPEN_PIECES, now)
        self._transmit(self._window, now)

    def _transmit(self, window: RequestWindow, now: float) -> None:
        for number in window.ask(now):
            offset = number * PIECE_BYTES
            piece = self._data[offset : offset + PIECE_BYTES]
            self._out.append(
                mavlink.MAVLink_darko_plan_file_message(
                    **target_fields(self._vehicle),
                    size=len(self._data),
                    crc=self._crc,
                    offset=offset,
                    count=len(piece),
                    data=list(piece.ljust(PIECE_BYTES, b"\0")),
                )
            )

    def _finish(self, text: str) -> None:
        self._window = None
        self._events.append(FlightPlanAnswered(text))
