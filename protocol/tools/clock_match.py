"""Times on another clock, told by packets of unknown delay: the quickest packets tell how far the clocks are apart."""

from __future__ import annotations

import math

__all__ = ["ClockMatch"]

MAX_STEP = 0.5  # a packet that differs by more comes of a clock that was set or restarted [s]


class ClockMatch:
    """Our time of what another clock has stamped.

    Args:
        window: Of which the quickest packet counts: clocks drift apart [s].
    """

    def __init__(self, window: float = 5.0) -> None:
        self._window = window
        self._before = self._least = math.inf  # least of (our time - theirs): in the last window, and in this one [s]
        self._began = -math.inf

    def hear(self, stamp: float, now: float) -> bool:
        """Take a packet that was sent at ``stamp`` of theirs; False if their clock has been set or restarted.

        Args:
            stamp: On their clock [s].
            now: On ours [s].
        """
        apart = now - stamp
        steady = not math.isfinite(self._least) or abs(apart - min(self._before, self._least)) < MAX_STEP
        if not steady:
            self._before = self._least = math.inf
        if now - self._began >= self._window:
            self._before, self._least, self._began = self._least, apart, now
        self._least = min(self._least, apart)
        return steady

    def ours(self, stamp: float) -> float:
        """Our time of a stamp of theirs [s]."""
        return stamp + min(self._before, self._least)

    def theirs(self, time: float) -> float:
        """Their time of a time of ours [s]."""
        return time - min(self._before, self._least)
