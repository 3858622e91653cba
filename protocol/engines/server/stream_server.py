"""Message rates of all links: what peers ask for (https://mavlink.io/en/services/message_interval.html).

Rates belong to a link, as on PX4 and ArduPilot: a request of one peer does not change the rates of the others. All
peers with the default rates share one schedule.

Some messages are not for everyone: pymavlink, and so MAVProxy, counts a message without a definition as lost. They
come in families. A link gets none of a family, neither streams nor events, until it asks for one of its messages with
SET_MESSAGE_INTERVAL or REQUEST_MESSAGE; then it gets all of them, at their default rates, until it sets every one of
its streams to -1 or is forgotten.

Requests are limited, so that no peer can use up the vehicle's time. A request beyond ``MAX_RATE_PER_LINK``,
``MAX_RATE_TOTAL``, ``REQUEST_RATE_PER_LINK`` or ``REQUEST_RATE_TOTAL`` is answered with TEMPORARILY_REJECTED and
changes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable, Iterable, Mapping
from types import MappingProxyType

from protocol.dialect import mavlink
from protocol.engines.base import Server, drop_oldest
from protocol.engines.server.data_stream_groups import DATA_STREAM_GROUPS
from protocol.engines.server.stream_scheduler import STREAM_OFF, StreamScheduler
from protocol.events import CommandRefused, CommandRequested, MessageRequested
from protocol.tools.token_bucket import TokenBucket
from protocol.wire.message import Message, Peer, addressed_to

__all__ = ["STREAM_COMMANDS", "Audience", "StreamServer"]

STREAM_COMMANDS = frozenset(
    {
        mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
        mavlink.MAV_CMD_GET_MESSAGE_INTERVAL,
        mavlink.MAV_CMD_REQUEST_MESSAGE,
        mavlink.MAV_CMD_GET_HOME_POSITION,
        mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION,
        mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
        mavlink.MAV_CMD_REQUEST_CAMERA_INFORMATION,
        mavlink.MAV_CMD_REQUEST_CAMERA_SETTINGS,
        mavlink.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS,
        mavlink.MAV_CMD_REQUEST_STORAGE_INFORMATION,
    }
)
MAX_RATE_PER_LINK = 2000.0  # [1/s] messages of one link with rates of its own
MAX_RATE_TOTAL = 6000.0  # [1/s] of all such links together
REQUEST_RATE_PER_LINK = 100.0  # [1/s] single messages that one link may request
REQUEST_BURST_PER_LINK = 200.0  # single messages it may request after a pause
REQUEST_RATE_TOTAL = 600.0  # [1/s] of all links together, so that changing the port with every frame does not help
_MAX_REQUESTING_LINKS = 32  # links whose token buckets are remembered
_TO_EVERYONE = 2.0  # param7 of MAV_CMD_REQUEST_MESSAGE
_ALIASES = {  # older commands that request one message
    mavlink.MAV_CMD_GET_HOME_POSITION: mavlink.MAVLINK_MSG_ID_HOME_POSITION,
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION: mavlink.MAVLINK_MSG_ID_PROTOCOL_VERSION,
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    mavlink.MAV_CMD_REQUEST_CAMERA_INFORMATION: mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION,
    mavlink.MAV_CMD_REQUEST_CAMERA_SETTINGS: mavlink.MAVLINK_MSG_ID_CAMERA_SETTINGS,
    mavlink.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS: mavlink.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS,
    mavlink.MAV_CMD_REQUEST_STORAGE_INFORMATION: mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION,
}
_BY_MAV_BOOL = frozenset(  # param1 is 1 or left out
    {mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION, mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES}
)

Audience = tuple[Hashable, ...] | None
"""Links that get a message; None: all of them."""


class StreamServer(Server):
    """Serves requests for message intervals, data streams and single messages, with a schedule for each link.

    A link has its own schedule only while its rates differ from the defaults and the link exists.

    Args:
        system: Own system id.
        component: Own component id.
        defaults: Interval [us] per id of the messages the vehicle streams, -1 for off.
        on_request: Ids of further messages, sent only on request.
        numbered: Number of instances per id, for messages with several; param2 of MAV_CMD_REQUEST_MESSAGE selects one
            of them, counted from 1, or all with 0.
        families: Groups of ids that a link gets only once it has asked for one of the group.
        fixed: Interval [us] per id of the messages that others send, at a rate that nobody can change.
        links: A live view of the existing links; None: they cannot be distinguished and share one schedule.
    """

    handles = frozenset({"REQUEST_DATA_STREAM"})

    def __init__(
        self,
        system: int,
        component: int,
        defaults: Mapping[int, int],
        on_request: Iterable[int] = (),
        *,
        numbered: Mapping[int, int] = MappingProxyType({}),
        families: Iterable[Collection[int]] = (),
        fixed: Mapping[int, int] = MappingProxyType({}),
        links: Collection[Hashable] | None = None,
    ) -> None:
        super().__init__()
        self._ids, self._links, self._numbered, self._fixed = (system, component), links, dict(numbered), dict(fixed)
        self._available = {*defaults, *on_request, *fixed}
        self._family = {number: frozenset(family) for family in families for number in family}
        self._shared = StreamScheduler(defaults, asleep=self._family)
        self._own: dict[Hashable, StreamScheduler] = {}
        self._buckets: dict[Hashable, TokenBucket] = {}
        self._total_bucket = TokenBucket(capacity=REQUEST_RATE_TOTAL, rate=REQUEST_RATE_TOTAL)

    @property
    def intervals(self) -> dict[Hashable, dict[int, int]]:
        """Intervals [us] in force per id: the shared ones under None, those of a link with its own under its key."""
        return {None: self._shared.intervals} | {key: own.intervals for key, own in self._own.items()}

    def receive(self, message: Message, now: float, peer: Peer) -> None:  # noqa: ARG002 - schedules have their own time
        """Take a REQUEST_DATA_STREAM; an unknown group or start_stop value changes nothing."""
        members = DATA_STREAM_GROUPS.get(message.req_stream_id)
        if members is None or message.start_stop > 1 or not addressed_to(message, *self._ids):
            return
        rate = message.req_message_rate
        interval = STREAM_OFF if not message.start_stop else 1e6 / rate if rate else 0.0
        schedule = self._begin(peer)
        if not self._is_affordable(peer, schedule, dict.fromkeys(members, interval)):
            refused = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_RESULT_TEMPORARILY_REJECTED
            self._events.append(CommandRefused(*refused, peer))
            return
        for number in members:
            schedule.set_interval(number, interval)
        self._settle(peer, schedule)

    def serve(self, request: CommandRequested, now: float) -> int:
        """Execute one of ``STREAM_COMMANDS``; returns its MAV_RESULT. A requested message is a ``MessageRequested``."""
        result = self._serve(request, now)
        if result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED:
            self._events.append(CommandRefused(request.command, result, request.peer))
        return result

    def _serve(self, request: CommandRequested, now: float) -> int:
        first, second = request.params[:2]
        if request.command in _BY_MAV_BOOL and request.param(1, 1.0) != 1.0:
            return int(mavlink.MAV_RESULT_DENIED)
        if request.command in _ALIASES:
            return self._request(_ALIASES[request.command], 0.0, request.peer, now)
        number = _message_id(first)
        if request.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            return self._set(number, second, request.peer)
        if request.command == mavlink.MAV_CMD_GET_MESSAGE_INTERVAL:
            return self._send_interval(number, request.peer)
        if number == mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL:  # replaces MAV_CMD_GET_MESSAGE_INTERVAL
            return self._send_interval(_message_id(second), request.peer)
        everyone = request.params[6] == _TO_EVERYONE
        return self._request(number, second, request.peer, now, everyone=everyone)

    def due(self, now_us: int) -> dict[int, Audience]:
        """Ids due at ``now_us`` [us], ascending, with their receivers, so that each message is built only once."""
        shared = self._shared.due(now_us)
        if self._links is None or not self._own:
            return dict.fromkeys(shared)
        self._forget()
        sharing = [key for key in self._links if key not in self._own]
        audience = {number: list(sharing) for number in shared if sharing}
        for key, own in self._own.items():
            for number in own.due(now_us):
                audience.setdefault(number, []).append(key)
        return {number: tuple(audience[number]) for number in sorted(audience)}

    def ask_for(self, number: int, peer: Peer) -> bool:
        """Let a link get the family of a message from now on; False if that is too much for it."""
        woken = self._asleep(number, peer)
        if not woken:
            return True
        schedule = self._begin(peer)
        if not self._is_affordable(peer, schedule, dict.fromkeys(woken, 0.0)):
            return False
        schedule.wake(woken)
        self._settle(peer, schedule)
        return True

    def audience(self, number: int) -> Audience:
        """The links that get a message which nobody in particular has asked for."""
        family = self._family.get(number)
        if family is None:
            return None
        if self._links is None:
            return None if self._shared.has_any(family) else ()
        self._forget()
        return tuple(key for key, own in self._own.items() if own.has_any(family))

    def next_due(self) -> float:
        """Time [us] of the next message for any link; infinity if all are off."""
        return min(schedule.next_due() for schedule in (self._shared, *self._own.values()))

    def _set(self, number: int, interval: float, peer: Peer) -> int:
        if number in self._fixed:
            is_kept = math.isnan(interval) or interval in {0.0, self._fixed[number]}
            return int(mavlink.MAV_RESULT_ACCEPTED if is_kept else mavlink.MAV_RESULT_DENIED)
        schedule = self._begin(peer)
        woken = frozenset[int]() if interval == STREAM_OFF else self._asleep(number, peer)
        if not self._is_affordable(peer, schedule, {**dict.fromkeys(woken, 0.0), number: interval}):
            return int(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        result = schedule.set_interval(number, interval)
        if result == mavlink.MAV_RESULT_ACCEPTED:
            schedule.wake(woken - {number})
            self._settle(peer, schedule)
        return result

    def _asleep(self, number: int, peer: Peer) -> frozenset[int]:
        """The family of a message, if the link has not asked for it yet."""
        family = self._family.get(number, frozenset())
        return frozenset() if self._own.get(peer.key, self._shared).has_any(family) else family

    def _send_interval(self, number: int, peer: Peer) -> int:
        if not 0 <= number <= 0xFFFF:  # does not fit MESSAGE_INTERVAL
            return int(mavlink.MAV_RESULT_DENIED)
        interval = self._fixed.get(number) or self._own.get(peer.key, self._shared).interval(number)
        self._reply(peer, mavlink.MAVLink_message_interval_message(number, interval))
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def _is_affordable(self, peer: Peer, schedule: StreamScheduler, wishes: Mapping[int, float]) -> bool:
        """Whether a link may have these intervals; a lower rate than before is always allowed."""
        rate = schedule.rate(wishes)
        others = sum(own.rate() for key, own in self._own.items() if key != peer.key)
        return rate <= max(schedule.rate(), min(MAX_RATE_PER_LINK, MAX_RATE_TOTAL - others))

    def _request(self, number: int, index: float, peer: Peer, now: float, *, everyone: bool = False) -> int:
        if number not in self._available:
            return int(mavlink.MAV_RESULT_UNSUPPORTED)
        index = 0.0 if math.isnan(index) else index
        if number in self._numbered and index not in range(self._numbered[number] + 1):
            return int(mavlink.MAV_RESULT_DENIED)
        copies = self._numbered.get(number, 1) if index == 0.0 else 1
        copies *= len(self._links) if everyone and self._links else 1
        if not self._may_ask(peer, copies, now) or not self.ask_for(number, peer):
            return int(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        self._events.append(MessageRequested(number, index, None if everyone else peer))
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def _may_ask(self, peer: Peer, copies: int, now: float) -> bool:
        new = TokenBucket(capacity=REQUEST_BURST_PER_LINK, rate=REQUEST_RATE_PER_LINK, now=now)
        bucket = self._buckets.setdefault(None if self._links is None else peer.key, new)
        drop_oldest(self._buckets, _MAX_REQUESTING_LINKS)
        return bucket.take(now, copies) and self._total_bucket.take(now, copies)

    def _begin(self, peer: Peer) -> StreamScheduler:
        """The schedule to change for a peer."""
        if self._links is None:
            return self._shared
        return self._own.get(peer.key) or self._shared.copy()

    def _settle(self, peer: Peer, schedule: StreamScheduler) -> None:
        """Store a changed schedule if it differs from the defaults."""
        if self._links is None:
            return
        if schedule.is_default:
            self._own.pop(peer.key, None)
        else:
            self._own[peer.key] = schedule
            self._forget()

    def _forget(self) -> None:
        for key in [key for key in self._own if self._links is not None and key not in self._links]:
            del self._own[key]


def _message_id(value: float) -> int:
    """A message id from a command parameter; -1 if it is not valid."""
    return int(value) if 0 <= value < 1 << 24 and value == int(value) else -1
