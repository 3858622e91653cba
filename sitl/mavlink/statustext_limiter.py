"""Limits the texts that peers make the vehicle send: a flood of requests must not become a flood of texts."""

from __future__ import annotations

from protocol.tools.timing import TokenBucket

MAX_BURST = 20  # texts in a row
TEXTS_PER_SECOND = 1.0  # after a burst
MIN_REPEAT_INTERVAL = 1.0  # between two texts that read the same [s]
MAX_REMEMBERED = 64  # texts that a new one is compared with


class StatustextLimiter:
    """Decides which texts in answer to peers are sent (STATUSTEXT), on the link's time, and counts the others."""

    def __init__(self) -> None:
        self._budget = TokenBucket(capacity=MAX_BURST, rate=TEXTS_PER_SECOND)
        self._sent_at: dict[str, float] = {}  # when each of the last texts was sent [s], oldest first
        self._withheld = 0

    @property
    def remembered(self) -> int:
        """Number of texts that a new one is compared with."""
        return len(self._sent_at)

    def admits(self, text: str, now: float, *, repeat_after: float = MIN_REPEAT_INTERVAL) -> bool:
        """True if ``text`` may be sent now.

        Args:
            text: The text.
            now: The link's time [s].
            repeat_after: The same text is dropped for this long [s]; such a repetition does not count as withheld.
        """
        if now - self._sent_at.get(text, float("-inf")) < repeat_after:
            return False
        if not self._budget.take(now):
            self._withheld += 1
            return False
        self._sent_at.pop(text, None)
        self._sent_at[text] = now
        if len(self._sent_at) > MAX_REMEMBERED:
            del self._sent_at[next(iter(self._sent_at))]
        return True

    def summary(self, now: float) -> str:
        """Text with the number of withheld texts, once half a burst may be sent again; else empty."""
        if not self._withheld or self._budget.level(now) < MAX_BURST / 2:
            return ""
        count, self._withheld = self._withheld, 0
        return f"{count} further answers were not sent"
