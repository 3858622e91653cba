"""The vehicle's side of the mission protocol (https://mavlink.io/en/services/mission.html).

Flight plan, fence and rally points are three plans that know nothing of each other; each is a
:class:`~protocol.engines.plan_store.PlanStore`. Here is what they have in common: who asked for which.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.base import Peer, Server, addressed_to, bound
from protocol.engines.plan_store import TRANSITIONS, PlanStore, Refusal, Validate
from protocol.engines.retransmission import LATE, precedes
from protocol.events import CurrentItemRequested, Event
from protocol.plans.mission import MissionItem

__all__ = ["TRANSITIONS", "MissionServer", "Refusal", "Validate"]

SENDERS = 64  # whose newest sequence numbers are known
# Late, they would undo what followed, or be refused for what was right when it was sent.
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
        items: The flight plan in force.
        validate: Looks at a complete new flight plan; a refusal keeps the old one.
        others: Fence and rally points in force, by MAV_MISSION_TYPE, each with its own ``validate``. Without one the
            vehicle has none to give and takes none.
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
            kind: PlanStore(kind, held, check, self._reply, self._tell) for kind, (held, check) in plans.items()
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
        """The flight plan in force."""
        return self._plan.items

    @property
    def current(self) -> int:
        """The item MISSION_CURRENT told last."""
        return self._plan.current

    @current.setter
    def current(self, seq: int) -> None:
        self._plan.current = seq

    def held(self, kind: int) -> tuple[MissionItem, ...]:
        """The plan of a MAV_MISSION_TYPE in force."""
        return self._stores[kind].items

    def mark(self, message: Message) -> None:
        """Complete a MISSION_CURRENT on its way out: the ids of the plans held."""
        self.current = message.seq
        ids = [self._stores[kind].opaque_id for kind in (_PLAN, *_OTHERS)]
        message.mission_id, message.fence_id, message.rally_points_id = ids

    @property
    def is_receiving(self) -> bool:
        """True while an upload is under way."""
        return any(store.is_receiving for store in self._stores.values())

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take any message of the mission protocol."""
        handler = self._handlers.get(message.get_type())
        if handler is None or not addressed_to(message, self._system, self._component):
            return
        if not (self._is_overtaken(message, now, peer) and self._is_harmful_late(message)):
            handler(message, now, peer)

    def next_deadline(self) -> float:
        """When an item must be asked for again."""
        return min(store.next_deadline() for store in self._stores.values())

    def handle_timer(self, now: float) -> None:
        """Ask again, or give an upload up."""
        for store in self._stores.values():
            store.handle_timer(now)

    def _tell(self, event: Event) -> None:
        self._events.append(event)

    def _is_overtaken(self, message: Message, now: float, peer: Peer) -> bool:
        """True for a frame that later ones of its sender overtook: it must not start anything any more."""
        number = message.get_seq()
        newest, heard = self._heard.get(peer[:2], (number, now))
        late = precedes(number, newest) and now - heard < LATE
        if not late:
            self._heard.pop(peer[:2], None)  # back to the end: who was silent longest is forgotten first
            self._heard[peer[:2]] = (number, now)
            bound(self._heard, SENDERS)
        return late

    def _is_harmful_late(self, message: Message) -> bool:
        if message.get_type() in _ASKING:
            store = self._stores.get(message.mission_type)
            return store is None or message.seq >= len(store.items)
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
        """Clear one plan, or all of them: then all or none."""
        kind = message.mission_type
        stores = [store for own, store in self._stores.items() if kind in {own, _ALL}]
        if not stores:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)
        elif any(store.is_busy_with_another(peer) for store in stores):
            self._ack(peer, mavlink.MAV_MISSION_DENIED, kind)
        else:
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
        if message.seq < len(self.items):
            self._events.append(CurrentItemRequested(message.seq))
        else:
            self._ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE)

    def _refuse_partial(self, message: Message, _now: float, peer: Peer) -> None:
        self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)

    def _ack(self, peer: Peer, result: int, kind: int = _PLAN) -> None:
        self._reply(peer, mavlink.MAVLink_mission_ack_message(peer.system, peer.component, result, kind))
