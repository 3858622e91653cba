"""The vehicle's side of the mission protocol (https://mavlink.io/en/services/mission.html).

Mission, fence and rally points are three independent plans; each is a
:class:`~protocol.engines.server.plan_store.PlanStore`. This engine hands each message to the right one.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from protocol.dialect import mavlink
from protocol.engines.base import Server, drop_oldest
from protocol.engines.retransmission import REORDER_WINDOW, precedes
from protocol.engines.server.plan_store import MissionInstead, PlanStore
from protocol.engines.server.replies import mission_ack
from protocol.events import CurrentItemRequested, Event
from protocol.plans.mission_item import MissionItem
from protocol.plans.plan import Validate
from protocol.wire.message import Message, Peer, addressed_to

__all__ = ["MissionServer"]

MAX_SENDERS = 64  # whose newest sequence numbers are remembered
# A late one would undo later messages, or be refused although it was right when it was sent.
_OPENING = frozenset({"MISSION_COUNT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT"})
_ASKING = frozenset({"MISSION_REQUEST", "MISSION_REQUEST_INT"})

_PLAN, _ALL = mavlink.MAV_MISSION_TYPE_MISSION, mavlink.MAV_MISSION_TYPE_ALL
_OTHERS = (mavlink.MAV_MISSION_TYPE_FENCE, mavlink.MAV_MISSION_TYPE_RALLY)
_ACCEPTED = mavlink.MAV_MISSION_ACCEPTED


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
