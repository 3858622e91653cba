"""Keeps simulated time beside the clock. The only place in the vehicle that sleeps."""

from __future__ import annotations

import time

LATEST = 0.5  # a pause longer than this (a suspended laptop) is forgotten, not caught up with [s]


class Pacer:
    """Paces simulation steps at ``speed`` times real time; 0 means as fast as possible."""

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._due = time.monotonic()

    def wait_time(self, simulated: float) -> float:
        """Account for ``simulated`` seconds flown and say how long to wait [s], never negative."""
        if self._speed == 0.0:
            return 0.0
        now = time.monotonic()
        self._due += simulated / self._speed
        if now - self._due > LATEST:
            self._due = now
        return max(0.0, self._due - now)
