"""A token bucket: a limit on how often something may happen, with a burst allowed after a pause."""

from __future__ import annotations

__all__ = ["TokenBucket"]


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
