"""Paces simulated time by the clock. The vehicle sleeps nowhere else."""

from __future__ import annotations

import time

MAX_LATENESS = 0.5  # a longer pause (a suspended laptop) is forgotten, not caught up with [s]


class Pacer:
    """Paces simulated time at ``speed`` times real time; 0 means as fast as possible.

    ``missed`` counts the steps that ended so late that the time of a further step had passed as well;
    ``longest_delay`` is the longest time by which one ended late [s].
    """

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._due = time.monotonic()
        self.missed, self.longest_delay = 0, 0.0

    def wait_time(self, simulated: float) -> float:
        """How long to wait after flying for ``simulated`` seconds [s], never negative."""
        if self._speed == 0.0:
            return 0.0
        now = time.monotonic()
        step = simulated / self._speed
        self._due += step
        delay = now - self._due
        self.missed += delay > step
        self.longest_delay = max(delay, self.longest_delay)
        if delay > MAX_LATENESS:
            self._due = now
        return max(0.0, -delay)
