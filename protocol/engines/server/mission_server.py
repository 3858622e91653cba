"""The vehicle's side of the mission protocol (https://mavlink.io/en/services/mission.html), and its plans.

The vehicle drives an upload: it requests one item after the other. The old plan stays in force until the new one is
complete and valid. A download needs no state: every request is answered by itself.

Mission, fence and rally points are three independent plans; each is a
:class:`~protocol.engines.server.mission_server.PlanStore`. This engine hands each message to the right one.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, NamedTuple

from protocol.dialect import mavlink
from protocol.engines.base import (
    MIN_TIMEOUT,
    REORDER_WINDOW,
    Remote,
    Retransmission,
    Server,
    TransitionTable,
    drop_oldest,
    fire,
    precedes,
)
from protocol.engines.server.replies import mission_ack
from protocol.errors import LocalProtocolError
from protocol.events import CurrentItemRequested, Event, MissionCleared, MissionReceived, MissionRefused
from protocol.plans.plan import MissionItem, Validate
from protocol.ranges import MAX_PLAN_ITEMS
from protocol.wire.message import Message, Peer, addressed_to, target_fields

MAX_STEPS_BACK = 2  # items before a missing one that are requested again together with it

_ACCEPTED, _CANCELLED = mavlink.MAV_MISSION_ACCEPTED, mavlink.MAV_MISSION_OPERATION_CANCELLED

PLAN_UPLOAD_TRANSITIONS: TransitionTable = {
    ("idle", "count"): "receiving",
    ("receiving", "count"): "receiving",
    ("receiving", "complete"): "idle",
    ("receiving", "cancel"): "idle",
    ("receiving", "give_up"): "idle",
}


_Reply = Callable[[Peer, Message], None]


class MissionInstead(NamedTuple):
    """Mission items that peers see in place of the mission."""

    items: tuple[MissionItem, ...]
    current: int  # the item that is flown
    reason: str  # why the mission cannot be changed meanwhile


@dataclass(slots=True, kw_only=True)
class _Upload:
    peer: Peer
    count: int
    opened: int  # sequence number of the message that began it
    at: float  # when that message came [s]
    first: int = 0  # the item requested first
    rest: tuple[MissionItem, ...] = ()  # items of the plan in force behind the replaced ones
    is_partial: bool = False
    remote: Remote = field(default_factory=lambda: Remote(MIN_TIMEOUT))  # knows only messages of the upload
    items: list[MissionItem] = field(default_factory=list)
    newest: int = 0  # sequence number of its last message before it ended
    result: int = _ACCEPTED  # its MAV_MISSION_RESULT
    is_answered: bool = True  # its end is acknowledged; not if the sender cancelled it

    def is_older(self, message: Message, now: float) -> bool:
        """True for a message that was sent before this upload began."""
        return now - self.at < REORDER_WINDOW and precedes(message.get_seq(), self.opened)


class PlanStore:
    """The plan of one type while the vehicle runs.

    Args:
        kind: MAV_MISSION_TYPE.
        items: The plan in force.
        validate: Checks a complete new plan; None: the vehicle has no plan of this type.
        reply: Sends a message to a peer.
        report: Receives events.
    """

    def __init__(
        self,
        kind: int,
        items: Sequence[MissionItem],
        *,
        validate: Validate | None,
        reply: _Reply,
        report: Callable[[Any], None],
    ) -> None:
        self.current = 0  # the item of the last MISSION_CURRENT
        self.items = tuple(items)  # the plan in force
        self._instead: MissionInstead | None = None  # what peers see meanwhile
        self._kind, self._validate, self._reply, self._report = kind, validate, reply, report
        self._state = "idle"
        self._resend = Retransmission(Remote())
        self._upload: _Upload | None = None  # the current one or the last one, whose answer may be lost

    @property
    def opaque_id(self) -> int:
        """Identifies the plan that peers see: the same on any vehicle and after a restart; 0 without a plan."""
        return plan_id(self.shown)

    @property
    def shown(self) -> tuple[MissionItem, ...]:
        """The plan that peers see."""
        return self.items if self._instead is None else self._instead.items

    @property
    def instead(self) -> MissionInstead | None:
        """Items that peers see in place of the plan; None: the plan."""
        return self._instead

    def show_instead(self, shown: MissionInstead | None) -> None:
        """Let peers see something else, which they cannot change; None: the plan. An upload under way ends."""
        self._instead = shown
        if shown is not None and self.is_receiving:
            self._end("cancel", mavlink.MAV_MISSION_DENIED, shown.reason)

    def refuses_change(self, peer: Peer, kind: int | None = None) -> bool:
        """Refuse a change with its reason while something else is shown; the answer is about a MAV_MISSION_TYPE."""
        if self._instead is None:
            return False
        denied = mavlink.MAV_MISSION_DENIED
        self._reply(peer, mission_ack(peer, denied, self._kind if kind is None else kind))
        self._report(MissionRefused(mavlink.MAV_MISSION_DENIED, self._instead.reason, self._kind))
        return True

    @property
    def is_receiving(self) -> bool:
        """True during an upload."""
        return self._state == "receiving"

    def is_busy_with_another(self, peer: Peer) -> bool:
        """True while another peer uploads."""
        return self.is_receiving and not self._is_ours(peer)

    def next_deadline(self) -> float:
        """Link time at which an item must be requested again [s]."""
        return self._resend.deadline

    def handle_timer(self, now: float) -> None:
        """Request an item again, or give up the upload."""
        if now < self._resend.deadline or self._upload is None:
            return
        if self._resend.retry(now):
            self._request_again(self._upload)
        else:
            self._end("give_up", _CANCELLED, f"item {len(self._upload.items)} did not arrive")

    # Upload

    def handle_count(self, message: Message, now: float, peer: Peer) -> None:
        """MISSION_COUNT: an upload begins, or (0 items) the plan is cleared."""
        if self.refuses_change(peer):
            return
        if self.is_busy_with_another(peer):
            self.acknowledge(peer, mavlink.MAV_MISSION_DENIED)
        elif message.count == 0:
            self.clear()
            self.acknowledge(peer, _ACCEPTED)
        elif self._validate is None:
            self.acknowledge(peer, mavlink.MAV_MISSION_UNSUPPORTED)
        elif message.count > MAX_PLAN_ITEMS:
            self.acknowledge(peer, mavlink.MAV_MISSION_NO_SPACE)
        else:
            self._begin(_Upload(peer=peer, count=message.count, opened=message.get_seq(), at=now))

    def handle_write_partial(self, message: Message, now: float, peer: Peer) -> None:
        """MISSION_WRITE_PARTIAL_LIST: some items are replaced, the others and the length stay.

        An end index one behind the last item means the last item, as MAVProxy counts.
        """
        if self.refuses_change(peer):
            return
        first, present = message.start_index, len(self.items)
        if self.is_busy_with_another(peer):
            self.acknowledge(peer, mavlink.MAV_MISSION_DENIED)
        elif self._validate is None:
            self.acknowledge(peer, mavlink.MAV_MISSION_UNSUPPORTED)
        elif not (0 <= first < present and first <= message.end_index <= present):
            self.acknowledge(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE)
        else:
            count = min(message.end_index + 1, present)
            before, rest = list(self.items[:first]), self.items[count:]
            sequence = message.get_seq()
            upload = _Upload(peer=peer, count=count, opened=sequence, at=now, first=first, rest=rest, items=before)
            upload.is_partial = True
            self._begin(upload)

    def handle_item(self, message: Message, now: float, peer: Peer) -> None:
        """MISSION_ITEM_INT or MISSION_ITEM."""
        upload = self._upload
        if upload is None or upload.peer[:2] != peer[:2] or upload.is_older(message, now):
            return
        upload.peer = peer
        upload.remote.heard = now
        if not self.is_receiving:
            self._answer_again(upload, message, peer)
            return
        upload.newest = message.get_seq()
        if message.seq > len(upload.items):
            self._request_item(upload, len(upload.items))
        elif message.seq == len(upload.items):  # an earlier item came twice: ignore it
            self._resend.answer(now)
            self._take(upload, message, now)

    def handle_ack(self, message: Message, now: float, peer: Peer) -> None:
        """MISSION_ACK: the sender of an upload may cancel it."""
        upload = self._upload
        if upload is None or not self._is_ours(peer) or upload.is_older(message, now):
            return
        if message.type != _ACCEPTED:
            upload.is_answered = False
            self._end("cancel", _CANCELLED, "cancelled by the sender")

    def _begin(self, upload: _Upload) -> None:
        self._state = fire(PLAN_UPLOAD_TRANSITIONS, self._state, "count")
        self._upload = upload
        self._resend = Retransmission(upload.remote)
        self._request_next(upload, upload.at)

    def _answer_again(self, upload: _Upload, message: Message, peer: Peer) -> None:
        """The sender of an ended upload repeats an item: our answer was lost."""
        is_end = message.seq == upload.count - 1 or upload.result != _ACCEPTED
        if is_end and upload.is_answered and not precedes(message.get_seq(), upload.newest):
            self.acknowledge(peer, upload.result)

    def _take(self, upload: _Upload, message: Message, now: float) -> None:
        try:
            upload.items.append(MissionItem.from_message(message))
        except LocalProtocolError as error:
            is_second = str(error).startswith("param6")
            result = mavlink.MAV_MISSION_INVALID_PARAM6_Y if is_second else mavlink.MAV_MISSION_INVALID_PARAM5_X
            self._end("cancel", result, f"item {message.seq}: {error}")
            return
        self._request_next(upload, now)

    def _request_next(self, upload: _Upload, now: float) -> None:
        if len(upload.items) < upload.count:
            self._resend.start(now)
            self._request_item(upload, len(upload.items))
            return
        items = (*upload.items, *upload.rest)
        refusal = self._validate(items) if self._validate is not None else None
        if refusal is not None:
            self._end("complete", refusal.result, refusal.text)
            return
        self.items = items
        self._end("complete", _ACCEPTED, "")

    def _request_again(self, upload: _Upload) -> None:
        """Request the missing item; after some repetitions also the items before it.

        A late duplicate of a request sets MAVSDK back to that item; it then ignores requests for later items.
        """
        wanted = len(upload.items)
        back = min(max(self._resend.times - 2, 0), MAX_STEPS_BACK, wanted - upload.first)
        for seq in range(wanted - back, wanted + 1):
            self._request_item(upload, seq)

    def _request_item(self, upload: _Upload, seq: int) -> None:
        peer = upload.peer
        self._reply(peer, mavlink.MAVLink_mission_request_int_message(peer.system, peer.component, seq, self._kind))

    def _end(self, trigger: str, result: int, reason: str) -> None:
        assert self._upload is not None  # noqa: S101 - guaranteed by the transition table
        self._state = fire(PLAN_UPLOAD_TRANSITIONS, self._state, trigger)
        self._resend.stop()
        self._upload.result = result
        if self._upload.is_answered:
            self.acknowledge(self._upload.peer, result)
        accepted = result == _ACCEPTED
        self._report(
            MissionReceived(self.items, self._kind, self._upload.is_partial)
            if accepted
            else MissionRefused(result, reason, self._kind)
        )

    def _is_ours(self, peer: Peer) -> bool:
        return self.is_receiving and self._upload is not None and self._upload.peer[:2] == peer[:2]

    # Clear and download

    def clear(self) -> None:
        """Delete the plan; the caller answers the peer."""
        if self._upload is not None and self.is_receiving:
            self._upload.is_answered = False  # the answer to the clear acknowledges it
            self._end("cancel", _CANCELLED, "cancelled by a clear")
        self._upload = None
        if self.items:
            self.items = ()
            self._report(MissionCleared(self._kind))

    def handle_list(self, peer: Peer) -> None:
        """MISSION_REQUEST_LIST: a download begins."""
        count = mavlink.MAVLink_mission_count_message(
            **target_fields(peer), count=len(self.shown), mission_type=self._kind, opaque_id=self.opaque_id
        )
        self._reply(peer, count)

    def handle_request(self, seq: int, peer: Peer) -> None:
        """MISSION_REQUEST_INT or MISSION_REQUEST: one item."""
        if seq >= len(self.shown):
            self.acknowledge(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE)
            return
        present = self.current if self._instead is None else self._instead.current
        current = self._kind == mavlink.MAV_MISSION_TYPE_MISSION and seq == present
        self._reply(peer, self.shown[seq].to_message(seq, *peer[:2], current=current, kind=self._kind))

    def acknowledge(self, peer: Peer, result: int) -> None:
        """Send a MISSION_ACK; an acceptance contains the id of the plan in force."""
        opaque_id = plan_id(self.items) if result == _ACCEPTED else 0
        self._reply(peer, mission_ack(peer, result, self._kind, opaque_id=opaque_id))


def plan_id(items: Sequence[MissionItem]) -> int:
    """CRC-32 of the items' bits on the wire, never 0; 0 if there are no items."""
    crc = 0
    for item in items:
        crc = zlib.crc32(item.wire_image(), crc)
    return (crc or 1) if items else 0


MAX_SENDERS = 64  # whose newest sequence numbers are remembered
# A late one would undo later messages, or be refused although it was right when it was sent.
_OPENING = frozenset({"MISSION_COUNT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT"})
_ASKING = frozenset({"MISSION_REQUEST", "MISSION_REQUEST_INT"})

_PLAN, _ALL = mavlink.MAV_MISSION_TYPE_MISSION, mavlink.MAV_MISSION_TYPE_ALL
_OTHERS = (mavlink.MAV_MISSION_TYPE_FENCE, mavlink.MAV_MISSION_TYPE_RALLY)


class MissionServer(Server):
    """Holds the plans while the vehicle runs.

    Args:
        system: Own system id.
        component: Own component id.
        items: The mission in force.
        validate: Checks a complete new mission; a refusal keeps the old one.
        others: Fence and rally points in force, by MAV_MISSION_TYPE, each with its own ``validate``. A type that is
            not given is refused.
    """

    def __init__(
        self,
        system: int,
        component: int,
        items: Sequence[MissionItem] = (),
        *,
        validate: Validate,
        others: Mapping[int, tuple[Sequence[MissionItem], Validate]] = MappingProxyType({}),
    ) -> None:
        super().__init__()
        self._system, self._component = system, component
        plans: dict[int, tuple[Sequence[MissionItem], Validate | None]] = {_PLAN: (items, validate)}
        plans |= {kind: others.get(kind, ((), None)) for kind in _OTHERS}
        self._stores = {
            kind: PlanStore(kind, items, validate=check, reply=self._reply, report=self._report)
            for kind, (items, check) in plans.items()
        }
        self._plan = self._stores[_PLAN]
        self._heard: dict[tuple[int, int], tuple[int, float]] = {}  # newest sequence number, and when
        self._handlers = {
            "MISSION_COUNT": self._handle_count,
            "MISSION_ITEM_INT": self._handle_item,
            "MISSION_ITEM": self._handle_item,
            "MISSION_ACK": self._handle_ack,
            "MISSION_CLEAR_ALL": self._handle_clear,
            "MISSION_REQUEST_LIST": self._handle_list,
            "MISSION_REQUEST_INT": self._handle_request,
            "MISSION_REQUEST": self._handle_request,
            "MISSION_SET_CURRENT": self._handle_set_current,
            "MISSION_REQUEST_PARTIAL_LIST": self._refuse_partial,
            "MISSION_WRITE_PARTIAL_LIST": self._handle_write_partial,
        }
        self.handles = frozenset(self._handlers)

    @property
    def items(self) -> tuple[MissionItem, ...]:
        """The mission in force."""
        return self._plan.items

    @property
    def current(self) -> int:
        """The item of the last MISSION_CURRENT."""
        return self._plan.current

    @current.setter
    def current(self, seq: int) -> None:
        self._plan.current = seq

    def plan(self, kind: int) -> tuple[MissionItem, ...]:
        """The plan of a MAV_MISSION_TYPE in force."""
        return self._stores[kind].items

    def mark(self, message: Message) -> None:
        """Complete an outgoing MISSION_CURRENT with the ids of the plans in force."""
        self.current = message.seq
        if (shown := self._plan.instead) is not None:
            message.seq, message.total = shown.current, len(shown.items)
            message.mission_state = mavlink.MISSION_STATE_ACTIVE if shown.items else mavlink.MISSION_STATE_NO_MISSION
            message.mission_mode = 1
        ids = [self._stores[kind].opaque_id for kind in (_PLAN, *_OTHERS)]
        message.mission_id, message.fence_id, message.rally_points_id = ids

    def show_instead(self, shown: MissionInstead | None) -> None:
        """Let peers see something else than the mission's items; None: those."""
        self._plan.show_instead(shown)

    @property
    def is_receiving(self) -> bool:
        """True during an upload."""
        return any(store.is_receiving for store in self._stores.values())

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take any message of the mission protocol."""
        handler = self._handlers.get(message.get_type())
        if handler is None or not addressed_to(message, self._system, self._component):
            return
        if not (self._is_overtaken(message, now, peer) and self._is_harmful_late(message)):
            handler(message, now, peer)

    def next_deadline(self) -> float:
        """Link time at which an item must be requested again [s]."""
        return min(store.next_deadline() for store in self._stores.values())

    def handle_timer(self, now: float) -> None:
        """Request an item again, or give up an upload."""
        for store in self._stores.values():
            store.handle_timer(now)

    def _report(self, event: Event) -> None:
        self._events.append(event)

    def _is_overtaken(self, message: Message, now: float, peer: Peer) -> bool:
        """True for a frame that arrives after later ones of its sender: it must not start anything any more."""
        number = message.get_seq()
        newest, heard = self._heard.get(peer[:2], (number, now))
        late = precedes(number, newest) and now - heard < REORDER_WINDOW
        if not late:
            self._heard.pop(peer[:2], None)  # to the end: the sender that was silent longest is forgotten first
            self._heard[peer[:2]] = (number, now)
            drop_oldest(self._heard, MAX_SENDERS)
        return late

    def _is_harmful_late(self, message: Message) -> bool:
        if message.get_type() in _ASKING:
            store = self._stores.get(message.mission_type)
            return store is None or message.seq >= len(store.shown)
        return message.get_type() in _OPENING

    def _handle_count(self, message: Message, now: float, peer: Peer) -> None:
        store = self._stores.get(message.mission_type)
        if store is None:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
        else:
            store.handle_count(message, now, peer)

    def _handle_write_partial(self, message: Message, now: float, peer: Peer) -> None:
        store = self._stores.get(message.mission_type)
        if store is None:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
        else:
            store.handle_write_partial(message, now, peer)

    def _handle_item(self, message: Message, now: float, peer: Peer) -> None:
        store = self._stores.get(message.mission_type)
        if store is not None:
            store.handle_item(message, now, peer)

    def _handle_ack(self, message: Message, now: float, peer: Peer) -> None:
        store = self._stores.get(message.mission_type)
        if store is not None:
            store.handle_ack(message, now, peer)

    def _handle_clear(self, message: Message, _now: float, peer: Peer) -> None:
        """Clear one plan, or all of them; if one cannot be cleared, none is."""
        kind = message.mission_type
        stores = [store for own, store in self._stores.items() if kind in {own, _ALL}]
        if not stores:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)
        elif any(store.is_busy_with_another(peer) for store in stores):
            self._ack(peer, mavlink.MAV_MISSION_DENIED, kind)
        elif not any(store.refuses_change(peer, kind) for store in stores):
            for store in stores:
                store.clear()
            self._ack(peer, _ACCEPTED, kind)

    def _handle_list(self, message: Message, _now: float, peer: Peer) -> None:
        store = self._stores.get(message.mission_type)
        if store is None:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
        else:
            store.handle_list(peer)

    def _handle_request(self, message: Message, _now: float, peer: Peer) -> None:
        store = self._stores.get(message.mission_type)
        if store is None:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
        else:
            store.handle_request(message.seq, peer)

    def _handle_set_current(self, message: Message, _now: float, peer: Peer) -> None:
        if self._plan.refuses_change(peer):
            return
        if message.seq < len(self.items):
            self._events.append(CurrentItemRequested(message.seq))
        else:
            self._ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE)

    def _refuse_partial(self, message: Message, _now: float, peer: Peer) -> None:
        self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)

    def _ack(self, peer: Peer, result: int, kind: int = _PLAN) -> None:
        self._reply(peer, mission_ack(peer, result, kind))
