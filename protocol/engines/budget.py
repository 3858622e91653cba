"""How much a peer may set off: a token bucket."""

__all__ = ["Budget"]


class Budget:
    """Fills with time up to a limit, and is spent.

    Args:
        per_second: What it fills by [1/s].
        most: What it holds at most.
        now: The link's time [s].
        tokens: What it holds at first.
    """

    def __init__(self, per_second: float, most: float, now: float, tokens: float = 0.0) -> None:
        self._rate, self._most, self._since, self._tokens = per_second, most, now, tokens

    def take(self, count: float, now: float) -> bool:
        """Spend ``count``, or nothing and give False where there is less."""
        self._tokens = min(self._tokens + self._rate * max(now - self._since, 0.0), self._most)
        self._since = now
        if count > self._tokens:
            return False
        self._tokens -= count
        return True
