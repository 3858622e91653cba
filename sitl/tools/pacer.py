"""Paces simulated time by the clock. The vehicle sleeps nowhere else."""

from __future__ import annotations

import math
import time

MAX_LATENESS = 0.5  # a longer pause (a suspended laptop) is forgotten, not caught up with [s]


class Pacer:
    """Paces simulated time at ``speed`` times real time; 0 means as fast as possible.

    ``longest_delay`` is the longest time by which a step ended late [s].

    Args:
        speed: Multiple of real time.
        tick: Simulated time between ticks of the autopilot, for ``missed`` [s].
    """

    def __init__(self, speed: float, tick: float = math.inf) -> None:
        self._speed = speed
        self._due = time.monotonic()
        self._tick = math.inf if speed == 0.0 else tick / speed
        self._flown_late, self.longest_delay = 0.0, 0.0

    @property
    def missed(self) -> int:
        """Autopilot ticks that were flown more than a tick late, or for which a longer pause left no time."""
        return round(self._flown_late / self._tick + 0.49)  # a begun one counts; rounding errors of the sum do not

    def wait_time(self, simulated: float) -> float:
        """Time to wait after flying for ``simulated`` seconds [s], never negative."""
        if self._speed == 0.0:
            return 0.0
        now = time.monotonic()
        step = simulated / self._speed
        self._due += step
        delay = now - self._due
        self._flown_late += step if delay > self._tick else 0.0
        self.longest_delay = max(delay, self.longest_delay)
        if delay > MAX_LATENESS:
            self._flown_late += delay
            self._due = now
        return max(0.0, -delay)
