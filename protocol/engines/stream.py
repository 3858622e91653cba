"""Message rates: which message is due when, and for whom (https://mavlink.io/en/services/message_interval.html).

Rates belong to a link, as they do on PX4 and ArduPilot: what one peer asks for changes nothing for the others. Peers
that are content with the defaults share one schedule, whatever their number. Time is an integer number of
microseconds, so a schedule is exact and the same on every run.
"""

import copy
import math
from collections.abc import Collection, Hashable, Iterable, Mapping
from types import MappingProxyType

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.base import Peer, Server, addressed_to
from protocol.errors import LocalProtocolError
from protocol.events import CommandRequested, MessageRequested

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
_LONGEST = 2**31 - 1  # [us]
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
        wanted = self._defaults[message_id] if math.isnan(interval) or interval == 0 else interval
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
        for number in members:
            schedule.set_interval(number, interval)
        self._settle(peer, schedule)

    def serve(self, request: CommandRequested) -> int:
        """Carry out one of ``COMMANDS``: the MAV_RESULT. A message that is asked for becomes ``MessageRequested``."""
        first, second = request.params[:2]
        if request.command in _BY_MAV_BOOL and request.param(1, 1.0) != 1.0:
            return int(mavlink.MAV_RESULT_DENIED)
        if request.command in _ALIASES:
            return self._request(_ALIASES[request.command], 0.0, request.peer)
        number = _message_id(first)
        if request.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            return self._set(number, second, request.peer)
        if request.command == mavlink.MAV_CMD_GET_MESSAGE_INTERVAL:
            return self._tell(number, request.peer)
        if number == mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL:  # what replaces MAV_CMD_GET_MESSAGE_INTERVAL
            return self._tell(_message_id(second), request.peer)
        everyone = request.params[6] == _TO_EVERYONE
        return self._request(number, second, None if everyone else request.peer)

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

    def _set(self, number: int, interval: float, peer: Peer) -> int:
        schedule = self._begin(peer)
        result = schedule.set_interval(number, interval)
        self._settle(peer, schedule)
        return result

    def _tell(self, number: int, peer: Peer) -> int:
        if not 0 <= number <= 0xFFFF:  # MESSAGE_INTERVAL has no room for it
            return int(mavlink.MAV_RESULT_DENIED)
        interval = self._own.get(peer.key, self._shared).interval(number)
        self._reply(peer, mavlink.MAVLink_message_interval_message(number, interval))
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def _request(self, number: int, index: float, peer: Peer | None) -> int:
        if number not in self._available:
            return int(mavlink.MAV_RESULT_UNSUPPORTED)
        index = 0.0 if math.isnan(index) else index
        if number in self._numbered and index not in range(self._numbered[number] + 1):
            return int(mavlink.MAV_RESULT_DENIED)
        self._events.append(MessageRequested(number, index, peer))
        return int(mavlink.MAV_RESULT_ACCEPTED)

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
