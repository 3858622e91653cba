"""One plan on the vehicle - flight plan, fence or rally points - and the upload that may replace it.

An upload is driven from here: the vehicle asks for one item after the other, and its old plan stays in force until the
new one is complete and valid. A download needs no state: every request is answered on its own.
"""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.base import Peer, Table, fire
from protocol.engines.retransmission import LATE, LEAST, Partner, Resend, precedes
from protocol.errors import LocalProtocolError
from protocol.events import MissionCleared, MissionReceived, MissionRefused
from protocol.plans.mission import MissionItem

__all__ = ["CAPACITY", "TRANSITIONS", "PlanStore", "Refusal", "Validate", "plan_id"]

CAPACITY = 1000  # items
STEPS_BACK = 2  # [-] from an item that does not come, to ask for those before it too

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
Reply = Callable[[Peer, Message], None]


@dataclass(slots=True)
class _Upload:
    peer: Peer
    count: int
    opened: int  # the sequence number of the message that began it, and
    at: float  # when that came
    first: int = 0  # the item that was asked for first
    rest: tuple[MissionItem, ...] = ()  # of the plan in force, behind what is written
    partner: Partner = field(default_factory=lambda: Partner(LEAST))  # heard when something of the upload comes
    items: list[MissionItem] = field(default_factory=list)
    newest: int = 0  # the sequence number of its last message while it was under way
    result: int = _ACCEPTED  # how it ended
    is_told: bool = True  # its sender waits for an answer; not after it cancelled

    def is_older(self, message: Message, now: float) -> bool:
        """True for a message that was sent before this upload began."""
        return now - self.at < LATE and precedes(message.get_seq(), self.opened)


class PlanStore:
    """The plan of one type while the vehicle runs; ``validate`` has the last word on a new one.

    Args:
        kind: MAV_MISSION_TYPE.
        items: The plan in force.
        validate: Looks at a complete new plan; None: this vehicle keeps no plan of this type.
        reply: Sends a message to a peer.
        tell: Takes an event.
    """

    def __init__(
        self,
        kind: int,
        items: Sequence[MissionItem],
        validate: Validate | None,
        reply: Reply,
        tell: Callable[[Any], None],
    ) -> None:
        self.current = 0  # the item MISSION_CURRENT told last
        self.items = tuple(items)  # the plan in force
        self._kind, self._validate, self._reply, self._tell = kind, validate, reply, tell
        self._state = "idle"
        self._resend = Resend(Partner())
        self._upload: _Upload | None = None  # under way, or the last one: its answer may be asked for again

    @property
    def opaque_id(self) -> int:
        """What tells this plan from others: the same on any vehicle and after a restart; 0: there is none."""
        return plan_id(self.items)

    @property
    def is_receiving(self) -> bool:
        """True while an upload is under way."""
        return self._state == "receiving"

    def is_busy_with_another(self, peer: Peer) -> bool:
        """True while somebody else uploads."""
        return self.is_receiving and not self._is_ours(peer)

    def next_deadline(self) -> float:
        """When an item must be asked for again."""
        return self._resend.deadline

    def handle_timer(self, now: float) -> None:
        """Ask again, or give an upload up."""
        if now < self._resend.deadline or self._upload is None:
            return
        if self._resend.retry(now):
            self._request_again(self._upload)
        else:
            self._end("give_up", _CANCELLED, f"item {len(self._upload.items)} never came")

    # Upload

    def handle_count(self, message: Message, now: float, peer: Peer) -> None:
        """MISSION_COUNT: an upload begins, or (0 items) the plan is cleared."""
        if self.is_busy_with_another(peer):
            self.acknowledge(peer, mavlink.MAV_MISSION_DENIED)
        elif message.count == 0:
            self.clear()
            self.acknowledge(peer, _ACCEPTED)
        elif self._validate is None:
            self.acknowledge(peer, mavlink.MAV_MISSION_UNSUPPORTED)
        elif message.count > CAPACITY:
            self.acknowledge(peer, mavlink.MAV_MISSION_NO_SPACE)
        else:
            self._begin(_Upload(peer, message.count, message.get_seq(), now))

    def handle_write_partial(self, message: Message, now: float, peer: Peer) -> None:
        """MISSION_WRITE_PARTIAL_LIST: some items are replaced, the others stay, and so does the length.

        An end one behind the last item means the last: MAVProxy counts so.
        """
        first, held = message.start_index, len(self.items)
        if self.is_busy_with_another(peer):
            self.acknowledge(peer, mavlink.MAV_MISSION_DENIED)
        elif self._validate is None:
            self.acknowledge(peer, mavlink.MAV_MISSION_UNSUPPORTED)
        elif not (0 <= first < held and first <= message.end_index <= held):
            self.acknowledge(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE)
        else:
            count = min(message.end_index + 1, held)
            before, rest = list(self.items[:first]), self.items[count:]
            self._begin(_Upload(peer, count, message.get_seq(), now, first=first, rest=rest, items=before))

    def handle_item(self, message: Message, now: float, peer: Peer) -> None:
        """MISSION_ITEM_INT or MISSION_ITEM."""
        upload = self._upload
        if upload is None or upload.peer[:2] != peer[:2] or upload.is_older(message, now):
            return
        upload.peer = peer
        upload.partner.heard = now
        if not self.is_receiving:
            self._answer_again(upload, message, peer)
            return
        upload.newest = message.get_seq()
        if message.seq > len(upload.items):
            self._request_item(upload, len(upload.items))
        elif message.seq == len(upload.items):  # an earlier one came twice: nothing to do
            self._resend.answer(now)
            self._take(upload, message, now)

    def handle_ack(self, message: Message, now: float, peer: Peer) -> None:
        """MISSION_ACK: the sender of an upload may cancel it."""
        upload = self._upload
        if upload is None or not self._is_ours(peer) or upload.is_older(message, now):
            return
        if message.type != _ACCEPTED:
            upload.is_told = False
            self._end("cancel", _CANCELLED, "cancelled by the sender")

    def _begin(self, upload: _Upload) -> None:
        self._state = fire(TRANSITIONS, self._state, "count")
        self._upload = upload
        self._resend = Resend(upload.partner)
        self._request_next(upload, upload.at)

    def _answer_again(self, upload: _Upload, message: Message, peer: Peer) -> None:
        """The sender of an upload that is over repeats an item: our answer was lost."""
        is_end = message.seq == upload.count - 1 or upload.result != _ACCEPTED
        if is_end and upload.is_told and not precedes(message.get_seq(), upload.newest):
            self.acknowledge(peer, upload.result)

    def _take(self, upload: _Upload, message: Message, now: float) -> None:
        try:
            upload.items.append(MissionItem.from_message(message))
        except LocalProtocolError as error:
            self._end("cancel", mavlink.MAV_MISSION_INVALID_PARAM5_X, f"item {message.seq}: {error}")
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
        """After a while the items before are asked for too, ever further back.

        A late duplicate of a request sets MAVSDK back to its item; what is further on it ignores from then on.
        """
        wanted = len(upload.items)
        back = min(max(self._resend.times - 2, 0), STEPS_BACK, wanted - upload.first)
        for seq in range(wanted - back, wanted + 1):
            self._request_item(upload, seq)

    def _request_item(self, upload: _Upload, seq: int) -> None:
        peer = upload.peer
        self._reply(peer, mavlink.MAVLink_mission_request_int_message(peer.system, peer.component, seq, self._kind))

    def _end(self, trigger: str, result: int, reason: str) -> None:
        assert self._upload is not None  # noqa: S101 - the state table admits no other way here
        self._state = fire(TRANSITIONS, self._state, trigger)
        self._resend.stop()
        self._upload.result = result
        if self._upload.is_told:
            self.acknowledge(self._upload.peer, result)
        accepted = result == _ACCEPTED
        self._tell(MissionReceived(self.items, self._kind) if accepted else MissionRefused(result, reason, self._kind))

    def _is_ours(self, peer: Peer) -> bool:
        return self.is_receiving and self._upload is not None and self._upload.peer[:2] == peer[:2]

    # Everything else

    def clear(self) -> None:
        """Hold no plan any more; who asked is answered by the caller."""
        if self._upload is not None and self.is_receiving:
            self._upload.is_told = False  # by the answer to the clear
            self._end("cancel", _CANCELLED, "cancelled by a clear")
        self._upload = None
        if self.items:
            self.items = ()
            self._tell(MissionCleared(self._kind))

    def handle_list(self, peer: Peer) -> None:
        """MISSION_REQUEST_LIST: a download begins."""
        count = mavlink.MAVLink_mission_count_message(*peer[:2], len(self.items), self._kind, self.opaque_id)
        self._reply(peer, count)

    def handle_request(self, seq: int, peer: Peer) -> None:
        """MISSION_REQUEST_INT or MISSION_REQUEST: one item."""
        if seq >= len(self.items):
            self.acknowledge(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE)
            return
        current = self._kind == mavlink.MAV_MISSION_TYPE_MISSION and seq == self.current
        self._reply(peer, self.items[seq].to_message(seq, *peer[:2], current=current, kind=self._kind))

    def acknowledge(self, peer: Peer, result: int) -> None:
        """Send a MISSION_ACK; one that accepts says the id of what is held now."""
        opaque_id = self.opaque_id if result == _ACCEPTED else 0
        self._reply(peer, mavlink.MAVLink_mission_ack_message(*peer[:2], result, self._kind, opaque_id))


def plan_id(items: Sequence[MissionItem]) -> int:
    """CRC-32 of the items' bits on the wire, never 0; 0 of no items."""
    crc = 0
    for item in items:
        crc = zlib.crc32(item.image(), crc)
    return (crc or 1) if items else 0
