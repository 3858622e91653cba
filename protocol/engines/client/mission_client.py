"""The ground station's side of the mission protocol (https://mavlink.io/en/services/mission.html).

In an upload, the vehicle requests one item after the other. In a download, this side requests several items at a time;
if the vehicle refuses requests out of order, the download starts anew and requests them one by one.
"""

from __future__ import annotations

from collections.abc import Sequence

from protocol.dialect import mavlink
from protocol.engines.base import Engine, Remote, RequestWindow, Retransmission, TransitionTable, fire
from protocol.errors import LocalProtocolError
from protocol.events import (
    CurrentItemSet,
    Event,
    MissionCleared,
    MissionDownloaded,
    MissionFailed,
    MissionProgress,
    MissionUploaded,
)
from protocol.names import enum_name
from protocol.plans.plan import MissionItem
from protocol.wire.message import Message, Source, addressed_to, source_of

MAX_OPEN_ITEM_REQUESTS = 5  # of a download
LATE_ANSWER_WINDOW = 5.0  # [s] at the start of an operation in which answers to the one before may arrive

_ACCEPTED, _CANCELLED = mavlink.MAV_MISSION_ACCEPTED, mavlink.MAV_MISSION_OPERATION_CANCELLED
_PLAN = mavlink.MAV_MISSION_TYPE_MISSION

MISSION_CLIENT_TRANSITIONS: TransitionTable = {
    ("idle", "upload"): "announcing",
    ("announcing", "request"): "serving",
    ("announcing", "done"): "idle",  # an upload without items
    ("announcing", "fail"): "idle",
    ("serving", "request"): "serving",
    ("serving", "done"): "idle",
    ("serving", "fail"): "idle",
    ("idle", "download"): "asking",
    ("asking", "count"): "fetching",
    ("asking", "fail"): "idle",
    ("fetching", "count"): "fetching",
    ("fetching", "again"): "asking",
    ("fetching", "done"): "idle",
    ("fetching", "fail"): "idle",
    ("idle", "clear"): "clearing",
    ("clearing", "done"): "idle",
    ("clearing", "fail"): "idle",
    ("idle", "set_current"): "selecting",
    ("selecting", "done"): "idle",
    ("selecting", "fail"): "idle",
}

_OPERATION = {
    "announcing": "upload",
    "serving": "upload",
    "asking": "download",
    "fetching": "download",
    "clearing": "clear",
    "selecting": "set_current",
}


class MissionClient(Engine[Message]):
    """One operation at a time: upload, download or clear a plan of one type, or select the current item.

    Args:
        system: Own system id.
        component: Own component id.
        remote: The vehicle's timing, shared by all engines of this end.
    """

    def __init__(self, system: int, component: int, remote: Remote | None = None) -> None:
        super().__init__()
        self._system, self._component = system, component
        self._remote = remote or Remote()
        self._vehicle: Source = (0, 0)
        self._kind = _PLAN  # MAV_MISSION_TYPE of this operation
        self._state, self._resend = "idle", Retransmission(self._remote)
        self._since = self._remote.mark(0.0)  # frames sent before it belong to an earlier operation
        self._last: Message | None = None  # repeated if there is no answer
        self._items: Sequence[MissionItem] = ()
        self._total, self._highest, self._wanted = 0, -1, 0
        self._first = 0  # item of an upload
        self._is_partial = False  # the upload
        self._found: dict[int, MissionItem] = {}
        self._plan_id = 0  # of the plan being downloaded
        self._window: RequestWindow | None = None  # missing items of a download, None before its count
        self._size = MAX_OPEN_ITEM_REQUESTS
        self._operations, self._begun = 0, 0.0  # number of operations, start of the last one
        # The last confirmed plan of each type, with the id from the vehicle if it sends ids.
        self._confirmed: dict[int, tuple[int, Sequence[MissionItem]]] = {}
        self._sends_ids = False
        # Which message is expected in which state; any other is late, repeated or not for us.
        self._handlers = {
            ("announcing", "MISSION_REQUEST_INT"): self._serve,
            ("announcing", "MISSION_REQUEST"): self._serve,
            ("serving", "MISSION_REQUEST_INT"): self._serve,
            ("serving", "MISSION_REQUEST"): self._serve,
            ("announcing", "MISSION_ACK"): self._take_upload_ack,
            ("serving", "MISSION_ACK"): self._take_upload_ack,
            ("asking", "MISSION_COUNT"): self._take_count,
            ("fetching", "MISSION_COUNT"): self._take_count,
            ("fetching", "MISSION_ITEM_INT"): self._take_item,
            ("asking", "MISSION_ACK"): self._take_error,
            ("fetching", "MISSION_ACK"): self._take_fetch_error,
            ("clearing", "MISSION_ACK"): self._take_clear_ack,
            ("selecting", "MISSION_CURRENT"): self._take_current,
            ("selecting", "MISSION_ACK"): self._take_error,
            ("idle", "MISSION_REQUEST_INT"): self._decline,
            ("idle", "MISSION_REQUEST"): self._decline,
        }

    @property
    def is_busy(self) -> bool:
        """True during an operation."""
        return self._state != "idle"

    def upload(self, vehicle: Source, items: Sequence[MissionItem], now: float, kind: int = _PLAN) -> None:
        """Replace the vehicle's plan of a MAV_MISSION_TYPE.

        Raises:
            LocalProtocolError: Another operation is not over, or the plan does not fit MISSION_COUNT.
        """
        if len(items) > 0xFFFF:
            raise LocalProtocolError(f"{len(items)} mission items: MISSION_COUNT allows 65535")
        self._begin("upload", vehicle, kind, now)
        self._items, self._total, self._highest = tuple(items), len(items), -1
        self._first, self._is_partial = 0, False
        self._send(mavlink.MAVLink_mission_count_message(*vehicle, len(items), kind), now)

    def write_items(self, vehicle: Source, items: Sequence[MissionItem], changed: range, now: float) -> None:
        """Replace some items of the vehicle's mission, which stays as long as it is.

        Args:
            vehicle: The vehicle.
            items: All items of the mission, as they are to be.
            changed: Numbers of those to be written.
            now: Now [s].

        Raises:
            LocalProtocolError: Another operation is not over, or the range does not fit the mission.
        """
        if not (changed and changed.start >= 0 and changed.stop <= len(items) <= 0xFFFF):
            raise LocalProtocolError(f"items {changed.start} to {changed.stop - 1} of {len(items)} cannot be written")
        self._begin("upload", vehicle, _PLAN, now)
        self._items, self._total, self._highest = tuple(items), changed.stop, changed.start - 1
        self._first, self._is_partial = changed.start, True
        self._send(
            mavlink.MAVLink_mission_write_partial_list_message(*vehicle, changed.start, changed.stop - 1, _PLAN), now
        )

    def download(self, vehicle: Source, now: float, kind: int = _PLAN) -> None:
        """Download the vehicle's plan of a MAV_MISSION_TYPE.

        Raises:
            LocalProtocolError: Another operation is not over.
        """
        self._begin("download", vehicle, kind, now)
        self._size = MAX_OPEN_ITEM_REQUESTS
        self._send(mavlink.MAVLink_mission_request_list_message(*vehicle, kind), now)

    def clear(self, vehicle: Source, now: float, kind: int = _PLAN) -> None:
        """Delete the vehicle's plan of a MAV_MISSION_TYPE; 255 means all of them.

        Raises:
            LocalProtocolError: Another operation is not over.
        """
        self._begin("clear", vehicle, kind, now)
        self._send(mavlink.MAVLink_mission_clear_all_message(*vehicle, kind), now)

    def set_current(self, vehicle: Source, seq: int, now: float) -> None:
        """Let the mission continue at item ``seq``.

        Raises:
            LocalProtocolError: Another operation is not over, or ``seq`` does not fit the wire.
        """
        if not 0 <= seq <= 0xFFFF:
            raise LocalProtocolError(f"mission item {seq} is not in 0..65535")
        self._begin("set_current", vehicle, _PLAN, now)
        self._wanted = seq
        self._send(mavlink.MAVLink_mission_set_current_message(*vehicle, seq), now)

    def cancel(self, reason: str) -> None:
        """End the operation, if there is one; the vehicle keeps its old plan."""
        if self.is_busy:
            self._fail(None, reason)

    def receive(self, message: Message, now: float) -> None:
        """Take any message of the mission protocol."""
        handler = self._handlers.get((self._state, message.get_type()))
        if handler is None or not addressed_to(message, self._system, self._component):
            return
        if self._remote.was_sent_before(self._since, message, now):
            return
        self._sends_ids |= bool(getattr(message, "opaque_id", 0))
        # While idle, any request of the vehicle is declined.
        if self._state == "idle" or getattr(message, "mission_type", _PLAN) == self._kind:
            handler(message, now)

    def next_deadline(self) -> float:
        """Link time at which a request must be repeated [s]."""
        return self._resend.deadline if self._window is None else self._window.deadline

    def handle_timer(self, now: float) -> None:
        """Repeat unanswered requests, or give up."""
        if now < self.next_deadline():
            return
        if self._window is not None and not self._window.is_over(now):
            self._ask(self._window, now)
        elif self._window is None and self._resend.retry(now):
            self._out.append(self._last)
        else:
            self._fail(None, "no answer")

    # Upload

    def _serve(self, message: Message, now: float) -> None:
        seq = message.seq
        if not self._first <= seq < self._total or seq > self._highest + 1:
            return  # out of turn: late from an earlier upload, or invalid
        self._state = fire(MISSION_CLIENT_TRANSITIONS, self._state, "request")
        item = self._items[seq].to_message(seq, *self._vehicle, current=seq == 0, kind=self._kind)
        if seq <= self._highest:  # repeated or late: if there is no answer, the newest item is repeated
            self._out.append(item)
            return
        self._resend.answer(now)
        self._send(item, now)
        self._since = self._remote.mark(now)  # valid frames come after this request
        self._highest = seq  # a request for an item confirms all items before it
        self._events.append(MissionProgress("upload", seq, self._total))

    def _take_upload_ack(self, message: Message, now: float) -> None:
        if message.type != _ACCEPTED:
            self._fail(message.type, _result_name(message))
        elif self._highest == self._total - 1:
            if not self._names_earlier_plan(message, now):
                self._confirmed[self._kind] = (message.opaque_id, self._items)
                self._finish(MissionUploaded(self._total - self._first, self._kind, self._is_partial))
        elif self._state == "serving" and not self._has_just_begun(now):  # otherwise it may be late
            self._fail(None, f"accepted before item {self._highest + 1} was requested")

    def _has_just_begun(self, now: float) -> bool:
        """True while answers to the operation before this one may arrive."""
        return self._operations > 1 and now - self._begun < LATE_ANSWER_WINDOW

    def _names_earlier_plan(self, ack: Message, now: float) -> bool:
        """True for an answer with the id of the plan held before this operation: it is late from the one before."""
        opaque_id, items = self._confirmed.get(self._kind, (0, ()))
        if not self._sends_ids or not self._has_just_begun(now) or ack.opaque_id != opaque_id:
            return False
        return opaque_id != 0 if self._state == "clearing" else items != self._items

    def _decline(self, message: Message, _now: float) -> None:
        """The vehicle requests an item of an upload that is over here: cancel it there."""
        self._out.append(mavlink.MAVLink_mission_ack_message(*source_of(message), _CANCELLED, message.mission_type))

    # Download

    def _take_count(self, message: Message, now: float) -> None:
        if self._state == "fetching" and (message.count, message.opaque_id) == (self._total, self._plan_id):
            return  # repeated
        if self._state == "asking":
            self._resend.answer(now)
        self._state = fire(MISSION_CLIENT_TRANSITIONS, self._state, "count")
        self._total, self._plan_id, self._found = message.count, message.opaque_id, {}
        self._since = self._remote.mark(now)  # items sent before the count belong to an earlier download
        self._window = RequestWindow(self._remote, range(self._total), self._size, now)
        self._ask(self._window, now)

    def _take_item(self, message: Message, now: float) -> None:
        if self._window is None or not self._window.take(message.seq, now):
            return
        self._found[message.seq] = MissionItem.from_message(message)
        self._events.append(MissionProgress("download", len(self._found), self._total))
        self._ask(self._window, now)

    def _ask(self, window: RequestWindow, now: float) -> None:
        for seq in window.ask(now):
            self._out.append(mavlink.MAVLink_mission_request_int_message(*self._vehicle, seq, self._kind))
        if not window.missing:
            self._out.append(mavlink.MAVLink_mission_ack_message(*self._vehicle, _ACCEPTED, self._kind))
            self._finish(MissionDownloaded(tuple(self._found[seq] for seq in range(self._total)), self._kind))

    def _take_fetch_error(self, message: Message, now: float) -> None:
        if message.type == _ACCEPTED:
            return
        if self._size == 1:
            self._fail(message.type, _result_name(message))
            return
        self._size, self._window = 1, None  # it may accept requests in order only
        self._state = fire(MISSION_CLIENT_TRANSITIONS, self._state, "again")
        self._since = self._remote.mark(now)
        self._send(mavlink.MAVLink_mission_request_list_message(*self._vehicle, self._kind), now)

    # Clear, current item, ends

    def _take_clear_ack(self, message: Message, now: float) -> None:
        if message.type != _ACCEPTED:
            self._fail(message.type, _result_name(message))
        elif not self._names_earlier_plan(message, now):
            self._confirmed.pop(self._kind, None)
            self._finish(MissionCleared(self._kind))

    def _take_current(self, message: Message, _now: float) -> None:
        if message.seq == self._wanted:
            self._finish(CurrentItemSet(message.seq))

    def _take_error(self, message: Message, _now: float) -> None:
        if message.type != _ACCEPTED:  # an acceptance belongs to another operation
            self._fail(message.type, _result_name(message))

    def _begin(self, operation: str, vehicle: Source, kind: int, now: float) -> None:
        self._state = fire(MISSION_CLIENT_TRANSITIONS, self._state, operation)
        if vehicle != self._vehicle:
            self._confirmed.clear()
        self._vehicle, self._kind = vehicle, kind
        self._since = self._remote.mark(now)
        self._operations, self._begun = self._operations + 1, now

    def _send(self, message: Message, now: float) -> None:
        self._last = message
        self._out.append(message)
        self._resend.start(now)

    def _finish(self, event: Event) -> None:
        self._end("done")
        self._events.append(event)

    def _fail(self, result: int | None, reason: str) -> None:
        operation = _OPERATION[self._state]
        self._end("fail")
        if operation in {"upload", "download"} and result is None:  # the vehicle does not know that it is over
            self._out.append(mavlink.MAVLink_mission_ack_message(*self._vehicle, _CANCELLED, self._kind))
        self._events.append(MissionFailed(operation, result, reason, self._kind))

    def _end(self, trigger: str) -> None:
        self._state = fire(MISSION_CLIENT_TRANSITIONS, self._state, trigger)
        self._resend.stop()
        self._window = None
        self._found = {}


def _result_name(ack: Message) -> str:
    return enum_name("MAV_MISSION_RESULT", ack.type, prefix="MAV_MISSION")
