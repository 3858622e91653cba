"""Paces simulated time by the clock. The vehicle sleeps nowhere else."""

from __future__ import annotations

import time

MAX_LATENESS = 0.5  # a longer pause (a suspended laptop) is forgotten, not caught up with [s]


class Pacer:
    """Paces simulated time at ``speed`` times real time; 0 means as fast as possible."""

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._due = time.monotonic()

    def wait_time(self, simulated: float) -> float:
        """How long to wait after flying for ``simulated`` seconds [s], never negative."""
        if self._speed == 0.0:
            return 0.0
        now = time.monotonic()
        self._due += simulated / self._speed
        if now - self._due > MAX_LATENESS:
            self._due = now
        return max(0.0, self._due - now)
