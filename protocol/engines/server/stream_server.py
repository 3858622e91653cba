"""Message rates of all links: what peers ask for, and what is due (https://mavlink.io/en/services/message_interval.html).

Time is an integer number of microseconds, so a schedule is exact and the same on every run.

Their members are ArduPilot's or, where this vehicle sends other messages, the most similar ones.

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

import copy
import math
from collections.abc import Collection, Hashable, Iterable, Mapping
from types import MappingProxyType

from protocol.dialect import mavlink
from protocol.engines.base import Server, drop_oldest
from protocol.errors import LocalProtocolError
from protocol.events import CommandRefused, CommandRequested, MessageRequested
from protocol.tools.timing import TokenBucket
from protocol.wire.message import Message, Peer, addressed_to

STREAM_OFF, STREAM_UNAVAILABLE = -1, 0  # intervals in MESSAGE_INTERVAL
_MAX_INTERVAL = 2**31 - 1  # [us]
_MIN_COUNTED_INTERVAL = 10_000  # [us] a vehicle publishes at most a hundred times a second


class StreamScheduler:
    """Decides which message ids are due.

    Args:
        defaults: Interval [us] per message id, -1 for off.
        asleep: Ids that are off until an interval is asked for, if only the default one.

    Raises:
        LocalProtocolError: A default interval is neither positive nor -1.
    """

    def __init__(self, defaults: Mapping[int, int], asleep: Iterable[int] = ()) -> None:
        for number, interval in defaults.items():
            if interval != STREAM_OFF and not 0 < interval <= _MAX_INTERVAL:
                raise LocalProtocolError(f"interval {interval} us of message {number} is not positive")
        self._defaults = dict(defaults)
        self._intervals = dict(sorted(defaults.items())) | {n: STREAM_OFF for n in asleep if n in defaults}
        self._first = dict(self._intervals)
        self._now_us = 0
        self._due = {number: 0 for number, interval in self._intervals.items() if interval != STREAM_OFF}
        self._soonest = self._find_soonest()

    @property
    def is_default(self) -> bool:
        """True while every interval is that of the beginning."""
        return self._intervals == self._first

    @property
    def intervals(self) -> dict[int, int]:
        """Intervals [us] in force per id, -1 for off."""
        return dict(self._intervals)

    def copy(self) -> StreamScheduler:
        """A second schedule with the same intervals and the same phase."""
        return copy.deepcopy(self)

    def has_any(self, message_ids: Collection[int]) -> bool:
        """Whether any of these is sent."""
        return not self._due.keys().isdisjoint(message_ids)

    def interval(self, message_id: int) -> int:
        """Interval [us] in force; -1: off, 0: no such stream."""
        return self._intervals.get(message_id, STREAM_UNAVAILABLE)

    def rate(self, wishes: Mapping[int, float] = MappingProxyType({})) -> float:
        """Messages per second, also as they would be with other intervals [us] for some ids."""
        wanted = self._intervals | {n: self._wanted(n, wish) for n, wish in wishes.items() if n in self._defaults}
        return sum(1e6 / max(interval, _MIN_COUNTED_INTERVAL) for interval in wanted.values() if interval > 0)

    def set_interval(self, message_id: int, interval: float) -> int:
        """Change one interval; an interval that is in force already keeps its phase.

        Args:
            message_id: Of the message.
            interval: [us]; 0 or NaN for the default, -1 for off.

        Returns:
            A MAV_RESULT: UNSUPPORTED if there is no such stream, DENIED if the interval is invalid.
        """
        if message_id not in self._defaults:
            return int(mavlink.MAV_RESULT_UNSUPPORTED)
        wanted = self._wanted(message_id, interval)
        if not (wanted == STREAM_OFF or 1 <= wanted <= _MAX_INTERVAL):
            return int(mavlink.MAV_RESULT_DENIED)
        wanted = round(wanted)
        if wanted != self._intervals[message_id]:
            self._intervals[message_id] = wanted
            self._due[message_id] = self._now_us
            if wanted == STREAM_OFF:
                del self._due[message_id]
            self._soonest = self._find_soonest()
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def wake(self, message_ids: Iterable[int]) -> None:
        """Send these at their default rates, in step with the messages that are sent from the beginning."""
        for number in message_ids:
            interval = self._defaults.get(number, STREAM_OFF)
            if interval != STREAM_OFF:
                self._intervals[number] = interval
                self._due[number] = -(-self._now_us // interval) * interval
        self._soonest = self._find_soonest()

    def due(self, now_us: int) -> list[int]:
        """Ids due at ``now_us``, ascending, each at most once: missed messages are not sent later."""
        self._now_us = now_us
        if now_us < self._soonest:
            return []
        ready = sorted(number for number, at in self._due.items() if at <= now_us)
        for number in ready:
            interval = self._intervals[number]
            self._due[number] += interval * ((now_us - self._due[number]) // interval + 1)
        self._soonest = self._find_soonest()
        return ready

    def next_due(self) -> float:
        """Time [us] of the next message; infinity if all are off."""
        return self._soonest

    def _wanted(self, message_id: int, interval: float) -> float:
        return self._defaults[message_id] if math.isnan(interval) or interval == 0 else interval

    def _find_soonest(self) -> float:
        return min(self._due.values(), default=math.inf)


_GROUPS: dict[int, tuple[int, ...]] = {
    mavlink.MAV_DATA_STREAM_RAW_SENSORS: (
        mavlink.MAVLINK_MSG_ID_RAW_IMU,
        mavlink.MAVLINK_MSG_ID_SCALED_IMU,
        mavlink.MAVLINK_MSG_ID_HIGHRES_IMU,
    ),
    mavlink.MAV_DATA_STREAM_EXTENDED_STATUS: (
        mavlink.MAVLINK_MSG_ID_SYS_STATUS,
        mavlink.MAVLINK_MSG_ID_GPS_RAW_INT,
        mavlink.MAVLINK_MSG_ID_MISSION_CURRENT,
        mavlink.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT,
        mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED,
        mavlink.MAVLINK_MSG_ID_FENCE_STATUS,
    ),
    mavlink.MAV_DATA_STREAM_RC_CHANNELS: (mavlink.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS,),
    mavlink.MAV_DATA_STREAM_RAW_CONTROLLER: (),
    mavlink.MAV_DATA_STREAM_POSITION: (
        mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
        mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    ),
    mavlink.MAV_DATA_STREAM_EXTRA1: (
        mavlink.MAVLINK_MSG_ID_ATTITUDE,
        mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION,
    ),
    mavlink.MAV_DATA_STREAM_EXTRA2: (mavlink.MAVLINK_MSG_ID_VFR_HUD,),
    mavlink.MAV_DATA_STREAM_EXTRA3: (
        mavlink.MAVLINK_MSG_ID_SYSTEM_TIME,
        mavlink.MAVLINK_MSG_ID_BATTERY_STATUS,
        mavlink.MAVLINK_MSG_ID_WIND_COV,
    ),
}
DATA_STREAM_GROUPS: Mapping[int, tuple[int, ...]] = MappingProxyType(
    {mavlink.MAV_DATA_STREAM_ALL: tuple(number for members in _GROUPS.values() for number in members), **_GROUPS}
)
"""Message ids by MAV_DATA_STREAM. A message outside all groups, such as a private one, keeps its rate."""


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
        """Send a message as often as a station asks for; the MAV_RESULT of that."""
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
