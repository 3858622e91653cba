"""Times of another clock, told by packets of unknown delay, and a limit on how often something may happen."""

from __future__ import annotations

import math

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


class TokenBucket:
    """Fills with time up to its capacity, and is spent by what is let through.

    Args:
        capacity: Tokens it holds at most: the burst that is let through after a pause.
        rate: Tokens it gains [1/s].
        now: The link's time [s].
        tokens: Tokens it holds at first; None: it is full.
    """

    def __init__(self, *, capacity: float, rate: float, now: float = 0.0, tokens: float | None = None) -> None:
        self._capacity, self._rate, self._since = capacity, rate, now
        self._tokens = capacity if tokens is None else tokens

    def take(self, now: float, count: float = 1.0) -> bool:
        """Spend ``count`` tokens; False, with nothing spent, if there are fewer."""
        if count > self.level(now):
            return False
        self._tokens -= count
        return True

    def level(self, now: float) -> float:
        """Tokens it holds now."""
        self._tokens = min(self._tokens + self._rate * max(now - self._since, 0.0), self._capacity)
        self._since = now
        return self._tokens
