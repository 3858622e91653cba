"""Message rates of one link: which message is due when (https://mavlink.io/en/services/message_interval.html).

Time is an integer number of microseconds, so a schedule is exact and the same on every run.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Collection, Iterable, Mapping
from types import MappingProxyType

from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError

__all__ = ["STREAM_OFF", "STREAM_UNAVAILABLE", "StreamScheduler"]

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
