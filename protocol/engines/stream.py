"""Message rates: which message is due when, and for whom (https://mavlink.io/en/services/message_interval.html).

Rates belong to a link, as they do on PX4 and ArduPilot: what one peer asks for changes nothing for the others. Peers
that are content with the defaults share one schedule, whatever their number. Time is an integer number of
microseconds, so a schedule is exact and the same on every run.

What links ask for is bounded, so that no peer can keep a vehicle from flying by what it has to say: what is beyond
``MOST_PER_LINK``, ``MOST_IN_ALL`` or ``ASKED_PER_SECOND`` is answered with TEMPORARILY_REJECTED, and changes nothing.
"""

import copy
import math
from collections.abc import Collection, Hashable, Iterable, Mapping
from types import MappingProxyType

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.base import Peer, Server, addressed_to, bound
from protocol.engines.budget import Budget
from protocol.errors import LocalProtocolError
from protocol.events import CommandRefused, CommandRequested, MessageRequested

__all__ = ["COMMANDS", "GROUPS", "OFF", "Audience", "StreamScheduler", "StreamServer"]

COMMANDS = frozenset(
    {
        mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
        mavlink.MAV_CMD_GET_MESSAGE_INTERVAL,
        mavlink.MAV_CMD_REQUEST_MESSAGE,
        mavlink.MAV_CMD_GET_HOME_POSITION,
        mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION,
        mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
    }
)
OFF, UNAVAILABLE = -1, 0  # what MESSAGE_INTERVAL says
MOST_PER_LINK = 2000.0  # messages a second of one link whose rates are its own,
MOST_IN_ALL = 6000.0  # of all such links together
ASKED_PER_SECOND, ASKED_AT_ONCE = 100.0, 200.0  # single messages a link may ask for, and after a pause,
ASKED_OF_ALL = 600.0  # and all links together: ports that change with every frame must not bring a budget each
_ASKING = 32  # links whose budgets are remembered
_SHORTEST, _LONGEST = 10_000, 2**31 - 1  # [us]; a vehicle looks for what is due a hundred times a second
_TO_EVERYONE = 2.0  # param7 of MAV_CMD_REQUEST_MESSAGE
_ALIASES = {  # older commands that ask for one message
    mavlink.MAV_CMD_GET_HOME_POSITION: mavlink.MAVLINK_MSG_ID_HOME_POSITION,
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION: mavlink.MAVLINK_MSG_ID_PROTOCOL_VERSION,
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
}
_BY_MAV_BOOL = frozenset(  # their param1 is 1, or left out
    {mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION, mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES}
)

# Groups of REQUEST_DATA_STREAM, with ArduPilot's members or, where it has other messages, their nearest kin.
_GROUPS: dict[int, tuple[int, ...]] = {
    mavlink.MAV_DATA_STREAM_RAW_SENSORS: (),
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
GROUPS: Mapping[int, tuple[int, ...]] = MappingProxyType(
    {mavlink.MAV_DATA_STREAM_ALL: tuple(number for members in _GROUPS.values() for number in members), **_GROUPS}
)
"""Message ids by MAV_DATA_STREAM. What is in none of them, private messages among it, keeps its rate."""

Audience = tuple[Hashable, ...] | None
"""Links that a message goes to; None: all of them."""


class StreamScheduler:
    """Which ids are due.

    Args:
        defaults: Interval [us] per message id, -1 for off.

    Raises:
        LocalProtocolError: A default interval is neither positive nor -1.
    """

    def __init__(self, defaults: Mapping[int, int]) -> None:
        for number, interval in defaults.items():
            if interval != OFF and not 0 < interval <= _LONGEST:
                raise LocalProtocolError(f"interval {interval} us of message {number} is not positive")
        self._defaults = dict(defaults)
        self._intervals = dict(sorted(defaults.items()))
        self._now_us = 0
        self._due = {number: 0 for number, interval in self._intervals.items() if interval != OFF}
        self._soonest = self._find_soonest()

    @property
    def is_default(self) -> bool:
        """True while every interval is the default one."""
        return self._intervals == self._defaults

    @property
    def intervals(self) -> dict[int, int]:
        """Intervals [us] in force per id, -1 for off."""
        return dict(self._intervals)

    def copy(self) -> "StreamScheduler":
        """Another schedule, so far the same beat for beat."""
        return copy.deepcopy(self)

    def interval(self, message_id: int) -> int:
        """Interval [us] in force; -1: off, 0: no such stream."""
        return self._intervals.get(message_id, UNAVAILABLE)

    def rate(self, wishes: Mapping[int, float] = MappingProxyType({})) -> float:
        """Messages a second there are, or would be with other intervals [us] for some ids."""
        wanted = self._intervals | {n: self._wanted(n, wish) for n, wish in wishes.items() if n in self._defaults}
        return sum(1e6 / max(interval, _SHORTEST) for interval in wanted.values() if interval > 0)

    def set_interval(self, message_id: int, interval: float) -> int:
        """Change one interval; what is in force already goes on undisturbed.

        Args:
            message_id: Of the message.
            interval: [us]; 0 or NaN for the default, -1 for off.

        Returns:
            A MAV_RESULT: UNSUPPORTED when there is no such stream, DENIED when the interval means nothing.
        """
        if message_id not in self._defaults:
            return int(mavlink.MAV_RESULT_UNSUPPORTED)
        wanted = self._wanted(message_id, interval)
        if not (wanted == OFF or 1 <= wanted <= _LONGEST):
            return int(mavlink.MAV_RESULT_DENIED)
        wanted = round(wanted)
        if wanted != self._intervals[message_id]:
            self._intervals[message_id] = wanted
            self._due[message_id] = self._now_us
            if wanted == OFF:
                del self._due[message_id]
            self._soonest = self._find_soonest()
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def due(self, now_us: int) -> list[int]:
        """Ids due at ``now_us``, ascending, each at most once: beats that were missed stay missed."""
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
        """Time [us] of the next message; infinity when all are off."""
        return self._soonest

    def _wanted(self, message_id: int, interval: float) -> float:
        return self._defaults[message_id] if math.isnan(interval) or interval == 0 else interval

    def _find_soonest(self) -> float:
        return min(self._due.values(), default=math.inf)


class StreamServer(Server):
    """A schedule per link, as its peer asks: by interval, by REQUEST_DATA_STREAM, or a single message.

    https://mavlink.io/en/messages/common.html#REQUEST_DATA_STREAM. A link has a schedule of its own only while its
    rates differ from the defaults, and loses it when it is gone.

    Args:
        system: Own system id.
        component: Own component id.
        defaults: Interval [us] per id of the messages the vehicle streams, -1 for off.
        on_request: Ids of further messages, sent only when asked for.
        numbered: How many there are of a message of which there are several, per id; param2 of
            MAV_CMD_REQUEST_MESSAGE asks for one of them, from 1 on, or for all by 0.
        links: A live view of the links there are; None: they cannot be told apart and share one schedule.
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
        links: Collection[Hashable] | None = None,
    ) -> None:
        super().__init__()
        self._ids, self._links, self._numbered = (system, component), links, dict(numbered)
        self._available = {*defaults, *on_request}
        self._shared = StreamScheduler(defaults)
        self._own: dict[Hashable, StreamScheduler] = {}
        self._asking: dict[Hashable, Budget] = {}
        self._asked_of_all = Budget(ASKED_OF_ALL, ASKED_OF_ALL, 0.0, ASKED_OF_ALL)

    @property
    def intervals(self) -> dict[Hashable, dict[int, int]]:
        """Intervals [us] in force per id: under None the shared ones, under a link's key its own where they differ."""
        return {None: self._shared.intervals} | {key: own.intervals for key, own in self._own.items()}

    def receive(self, message: Message, now: float, peer: Peer) -> None:  # noqa: ARG002 - schedules keep their own time
        """Take a REQUEST_DATA_STREAM; a group or an order that does not exist changes nothing."""
        members = GROUPS.get(message.req_stream_id)
        if members is None or message.start_stop > 1 or not addressed_to(message, *self._ids):
            return
        rate = message.req_message_rate
        interval = OFF if not message.start_stop else 1e6 / rate if rate else 0.0
        schedule = self._begin(peer)
        if not self._is_affordable(peer, schedule, dict.fromkeys(members, interval)):
            refused = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_RESULT_TEMPORARILY_REJECTED
            self._events.append(CommandRefused(*refused, peer))
            return
        for number in members:
            schedule.set_interval(number, interval)
        self._settle(peer, schedule)

    def serve(self, request: CommandRequested, now: float) -> int:
        """Carry out one of ``COMMANDS``: the MAV_RESULT. A message that is asked for becomes ``MessageRequested``."""
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
            return self._tell(number, request.peer)
        if number == mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL:  # what replaces MAV_CMD_GET_MESSAGE_INTERVAL
            return self._tell(_message_id(second), request.peer)
        everyone = request.params[6] == _TO_EVERYONE
        return self._request(number, second, request.peer, now, everyone=everyone)

    def due(self, now_us: int) -> dict[int, Audience]:
        """Ids due at ``now_us`` [us], ascending, and for whom: each message is built once, whoever gets it."""
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

    def next_due(self) -> float:
        """Time [us] of the next message for anybody; infinity when all are off."""
        return min(schedule.next_due() for schedule in (self._shared, *self._own.values()))

    def _set(self, number: int, interval: float, peer: Peer) -> int:
        schedule = self._begin(peer)
        if not self._is_affordable(peer, schedule, {number: interval}):
            return int(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        result = schedule.set_interval(number, interval)
        self._settle(peer, schedule)
        return result

    def _tell(self, number: int, peer: Peer) -> int:
        if not 0 <= number <= 0xFFFF:  # MESSAGE_INTERVAL has no room for it
            return int(mavlink.MAV_RESULT_DENIED)
        interval = self._own.get(peer.key, self._shared).interval(number)
        self._reply(peer, mavlink.MAVLink_message_interval_message(number, interval))
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def _is_affordable(self, peer: Peer, schedule: StreamScheduler, wishes: Mapping[int, float]) -> bool:
        """Whether a link may have these intervals; fewer messages than before it always may."""
        rate = schedule.rate(wishes)
        others = sum(own.rate() for key, own in self._own.items() if key != peer.key)
        return rate <= max(schedule.rate(), min(MOST_PER_LINK, MOST_IN_ALL - others))

    def _request(self, number: int, index: float, peer: Peer, now: float, *, everyone: bool = False) -> int:
        if number not in self._available:
            return int(mavlink.MAV_RESULT_UNSUPPORTED)
        index = 0.0 if math.isnan(index) else index
        if number in self._numbered and index not in range(self._numbered[number] + 1):
            return int(mavlink.MAV_RESULT_DENIED)
        copies = self._numbered.get(number, 1) if index == 0.0 else 1
        copies *= len(self._links) if everyone and self._links else 1
        if not self._may_ask(peer, copies, now):
            return int(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        self._events.append(MessageRequested(number, index, None if everyone else peer))
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def _may_ask(self, peer: Peer, copies: int, now: float) -> bool:
        fresh = Budget(ASKED_PER_SECOND, ASKED_AT_ONCE, now, ASKED_AT_ONCE)
        budget = self._asking.setdefault(None if self._links is None else peer.key, fresh)
        bound(self._asking, _ASKING)
        return budget.take(copies, now) and self._asked_of_all.take(copies, now)

    def _begin(self, peer: Peer) -> StreamScheduler:
        """The schedule to change for a peer."""
        if self._links is None:
            return self._shared
        return self._own.get(peer.key) or self._shared.copy()

    def _settle(self, peer: Peer, schedule: StreamScheduler) -> None:
        """Keep a changed schedule, as long as it is needed."""
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
    """A message's id as a command carries it; -1 when it is none."""
    return int(value) if 0 <= value < 1 << 24 and value == int(value) else -1
