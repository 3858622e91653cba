"""Message intervals: which message is due when (https://mavlink.io/en/services/message_interval.html).

Time is an integer number of microseconds, so the schedule is exact and the same on every run.
"""

import math
from collections.abc import Container, Mapping

from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError

__all__ = ["COMMANDS", "StreamScheduler"]

COMMANDS = frozenset(
    {
        mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
        mavlink.MAV_CMD_GET_MESSAGE_INTERVAL,
        mavlink.MAV_CMD_REQUEST_MESSAGE,
        mavlink.MAV_CMD_GET_HOME_POSITION,
        mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
    }
)
OFF, UNAVAILABLE = -1, 0  # what MESSAGE_INTERVAL says
_LONGEST = 2**31 - 1  # [us]


class StreamScheduler:
    """Which ids are due, of those the vehicle has.

    Args:
        defaults: Interval [us] per message id, -1 for off.
        on_request: Further ids, sent only when asked for.

    Raises:
        LocalProtocolError: A default interval is neither positive nor -1.
    """

    def __init__(self, defaults: Mapping[int, int], on_request: Container[int] = ()) -> None:
        for number, interval in defaults.items():
            if interval != OFF and not 0 < interval <= _LONGEST:
                raise LocalProtocolError(f"interval {interval} us of message {number} is not positive")
        self._defaults, self._on_request = dict(defaults), on_request
        self._intervals = dict(sorted(defaults.items()))
        self._now_us = 0
        self._due = {number: 0 for number, interval in self._intervals.items() if interval != OFF}

    def is_available(self, message_id: int) -> bool:
        """True when the vehicle can send this message."""
        return message_id in self._defaults or message_id in self._on_request

    def interval(self, message_id: int) -> int:
        """Interval [us] in force; -1: off, 0: no such stream."""
        return self._intervals.get(message_id, UNAVAILABLE)

    def set_interval(self, message_id: int, interval: float) -> int:
        """MAV_CMD_SET_MESSAGE_INTERVAL: [us], 0 or NaN for the default, -1 for off. Returns a MAV_RESULT."""
        if message_id not in self._defaults:
            return int(mavlink.MAV_RESULT_UNSUPPORTED)
        wanted = self._defaults[message_id] if math.isnan(interval) or interval == 0 else interval
        if not (wanted == OFF or 1 <= wanted <= _LONGEST):
            return int(mavlink.MAV_RESULT_DENIED)
        self._intervals[message_id] = round(wanted)
        if wanted == OFF:
            self._due.pop(message_id, None)
        else:
            self._due[message_id] = self._now_us
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def due(self, now_us: int) -> list[int]:
        """Ids due at ``now_us``, ascending, each at most once: beats that were missed stay missed."""
        self._now_us = now_us
        ready = sorted(number for number, at in self._due.items() if at <= now_us)
        for number in ready:
            interval = self._intervals[number]
            self._due[number] += interval * ((now_us - self._due[number]) // interval + 1)
        return ready

    def next_due(self) -> float:
        """Time [us] of the next message; infinity when all are off."""
        return min(self._due.values(), default=math.inf)
