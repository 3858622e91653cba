"""The vehicle's side of the mission protocol (https://mavlink.io/en/services/mission.html).

An upload is driven from here: the vehicle asks for one item after the other, and its old plan stays in force
until the new one is complete and valid. A download needs no state: every request is answered on its own. Only
flight plans exist here; of fences and rally points there are none to give, and none are taken.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.base import Patience, Peer, Server, Table, addressed_to, fire
from protocol.events import CurrentItemRequested, MissionCleared, MissionReceived, MissionRefused
from protocol.plans.mission import MissionItem

__all__ = ["ITEM_WAITS", "TRANSITIONS", "MissionServer", "Refusal", "Validate"]

ITEM_WAITS = (0.25, 0.5, 1.0, 1.5, 1.5, 1.5)  # [s] between requests for one item
CAPACITY = 1000  # items
OVERTAKEN = 2.0  # [s] a frame may be late by; sequence numbers wrap too soon to look further back

_PLAN, _ALL = mavlink.MAV_MISSION_TYPE_MISSION, mavlink.MAV_MISSION_TYPE_ALL
_EMPTY = frozenset({mavlink.MAV_MISSION_TYPE_FENCE, mavlink.MAV_MISSION_TYPE_RALLY})
_ACCEPTED, _CANCELLED = mavlink.MAV_MISSION_ACCEPTED, mavlink.MAV_MISSION_OPERATION_CANCELLED

TRANSITIONS: Table = {
    ("idle", "count"): "receiving",
    ("receiving", "count"): "receiving",
    ("receiving", "complete"): "idle",
    ("receiving", "cancel"): "idle",
    ("receiving", "give_up"): "idle",
}


class Refusal(NamedTuple):
    """Why a plan cannot be flown: a MAV_MISSION_RESULT and a sentence."""

    result: int
    text: str


Validate = Callable[[Sequence[MissionItem]], Refusal | None]


@dataclass(slots=True)
class _Upload:
    peer: Peer
    count: int
    items: list[MissionItem] = field(default_factory=list)
    result: int = _ACCEPTED  # how it ended


class MissionServer(Server):
    """Holds the plan while the vehicle runs; ``validate`` has the last word on a new one."""

    def __init__(self, system: int, component: int, items: Sequence[MissionItem] = (), *, validate: Validate) -> None:
        super().__init__()
        self.current = 0  # the item MISSION_CURRENT told last
        self._system, self._component, self._validate = system, component, validate
        self._items = tuple(items)
        self._state, self._patience = "idle", Patience(ITEM_WAITS)
        self._upload: _Upload | None = None  # under way, or the last one: its answer may be asked for again
        self._heard: dict[tuple[int, int], tuple[int, float]] = {}  # newest sequence number, and when
        self._handlers = {
            "MISSION_COUNT": self._handle_count,
            "MISSION_ITEM_INT": self._handle_item,
            "MISSION_ACK": self._handle_ack,
            "MISSION_CLEAR_ALL": self._handle_clear,
            "MISSION_REQUEST_LIST": self._handle_list,
            "MISSION_REQUEST_INT": self._handle_request,
            "MISSION_REQUEST": self._handle_request,
            "MISSION_SET_CURRENT": self._handle_set_current,
            "MISSION_REQUEST_PARTIAL_LIST": self._refuse_partial,
            "MISSION_WRITE_PARTIAL_LIST": self._refuse_partial,
        }
        self.handles = frozenset(self._handlers)

    @property
    def items(self) -> tuple[MissionItem, ...]:
        """The plan in force."""
        return self._items

    @property
    def is_receiving(self) -> bool:
        """True while an upload is under way."""
        return self._state == "receiving"

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take any message of the mission protocol."""
        handler = self._handlers.get(message.get_type())
        if handler is None or not addressed_to(message, self._system, self._component):
            return
        opens = message.get_type() in {"MISSION_COUNT", "MISSION_CLEAR_ALL"}
        if not self._is_overtaken(message, now, peer) or not opens:
            handler(message, now, peer)

    def next_deadline(self) -> float:
        """When an item must be asked for again."""
        return self._patience.deadline

    def handle_timer(self, now: float) -> None:
        """Ask again, or give an upload up."""
        if now < self._patience.deadline or self._upload is None:
            return
        if self._patience.retry(now):
            self._request_item(self._upload)
        else:
            self._end("give_up", _CANCELLED, f"item {len(self._upload.items)} never came")

    def _is_overtaken(self, message: Message, now: float, peer: Peer) -> bool:
        """True for a frame that later ones of its sender overtook: it must not start anything any more."""
        number = message.get_seq()
        newest, heard = self._heard.get(peer[:2], (number, now))
        late = 0 < (newest - number) & 0xFF < 128 and now - heard < OVERTAKEN
        if not late:
            self._heard[peer[:2]] = (number, now)
        return bool(late)

    # Upload

    def _handle_count(self, message: Message, now: float, peer: Peer) -> None:
        if message.mission_type != _PLAN:
            nothing = message.mission_type in _EMPTY and message.count == 0
            self._ack(peer, _ACCEPTED if nothing else mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
        elif self._is_busy_with_another(peer):
            self._ack(peer, mavlink.MAV_MISSION_DENIED)
        elif message.count == 0:
            self._clear(peer)
        elif message.count > CAPACITY:
            self._ack(peer, mavlink.MAV_MISSION_NO_SPACE)
        else:
            self._state = fire(TRANSITIONS, self._state, "count")
            self._upload = _Upload(peer, message.count)
            self._request_next(self._upload, now)

    def _handle_item(self, message: Message, now: float, peer: Peer) -> None:
        upload = self._upload
        if upload is None or upload.peer[:2] != peer[:2] or message.mission_type != _PLAN:
            return
        upload.peer = peer
        if not self.is_receiving:
            if message.seq == upload.count - 1:  # our answer was lost
                self._ack(peer, upload.result)
            return
        if message.seq > len(upload.items):
            self._request_item(upload)
        elif message.seq == len(upload.items):  # an earlier one came twice: nothing to do
            upload.items.append(MissionItem.from_message(message))
            self._request_next(upload, now)

    def _handle_ack(self, message: Message, _now: float, peer: Peer) -> None:
        if self._is_ours(peer) and message.mission_type == _PLAN and message.type != _ACCEPTED:
            self._end("cancel", _CANCELLED, "cancelled by the sender")

    def _request_next(self, upload: _Upload, now: float) -> None:
        if len(upload.items) < upload.count:
            self._patience.start(now)
            self._request_item(upload)
            return
        refusal = self._validate(upload.items)
        if refusal is not None:
            self._end("complete", refusal.result, refusal.text)
            return
        self._items = tuple(upload.items)
        self._end("complete", _ACCEPTED, "")

    def _request_item(self, upload: _Upload) -> None:
        peer, seq = upload.peer, len(upload.items)
        self._reply(peer, mavlink.MAVLink_mission_request_int_message(peer.system, peer.component, seq))

    def _end(self, trigger: str, result: int, reason: str) -> None:
        assert self._upload is not None  # noqa: S101 - the state table admits no other way here
        self._state = fire(TRANSITIONS, self._state, trigger)
        self._patience.stop()
        self._upload.result = result
        self._ack(self._upload.peer, result)
        accepted = result == _ACCEPTED
        self._events.append(MissionReceived(self._items) if accepted else MissionRefused(result, reason))

    def _is_ours(self, peer: Peer) -> bool:
        return self.is_receiving and self._upload is not None and self._upload.peer[:2] == peer[:2]

    def _is_busy_with_another(self, peer: Peer) -> bool:
        return self.is_receiving and not self._is_ours(peer)

    # Everything else

    def _handle_clear(self, message: Message, _now: float, peer: Peer) -> None:
        if message.mission_type in _EMPTY:
            self._ack(peer, _ACCEPTED, message.mission_type)
        elif message.mission_type not in {_PLAN, _ALL}:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
        elif self._is_busy_with_another(peer):
            self._ack(peer, mavlink.MAV_MISSION_DENIED, message.mission_type)
        else:
            self._clear(peer, message.mission_type)

    def _clear(self, peer: Peer, kind: int = _PLAN) -> None:
        if self.is_receiving:
            self._end("cancel", _CANCELLED, "cancelled by a clear")
        self._upload = None
        if self._items:
            self._items = ()
            self._events.append(MissionCleared())
        self._ack(peer, _ACCEPTED, kind)

    def _handle_list(self, message: Message, _now: float, peer: Peer) -> None:
        kind = message.mission_type
        if kind != _PLAN and kind not in _EMPTY:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)
            return
        count = len(self._items) if kind == _PLAN else 0
        self._reply(peer, mavlink.MAVLink_mission_count_message(peer.system, peer.component, count, kind))

    def _handle_request(self, message: Message, _now: float, peer: Peer) -> None:
        seq = message.seq
        if message.mission_type != _PLAN or seq >= len(self._items):
            self._ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, message.mission_type)
            return
        item = self._items[seq].to_message(seq, peer.system, peer.component, current=seq == self.current)
        self._reply(peer, item)

    def _handle_set_current(self, message: Message, _now: float, peer: Peer) -> None:
        if message.seq < len(self._items):
            self._events.append(CurrentItemRequested(message.seq))
        else:
            self._ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE)

    def _refuse_partial(self, message: Message, _now: float, peer: Peer) -> None:
        self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)

    def _ack(self, peer: Peer, result: int, kind: int = _PLAN) -> None:
        self._reply(peer, mavlink.MAVLink_mission_ack_message(peer.system, peer.component, result, kind))
