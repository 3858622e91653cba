"""How often peers make the vehicle speak: a flood of orders must not become a flood of texts."""

from __future__ import annotations

BURST = 20  # texts in a row
RECOVERY = 1.0  # [s] until one more may follow
SAME_TEXT = 1.0  # [s] between two that read the same
REMEMBERED = 64  # texts that are compared


class TextLimiter:
    """Decides which answers in words (STATUSTEXT) go out, on the link's time; how many did not is said later."""

    def __init__(self) -> None:
        self._left, self._since = float(BURST), 0.0
        self._said: dict[str, float] = {}  # when each of the last texts went out, oldest first
        self._withheld = 0

    def admits(self, text: str, now: float, *, again: float = SAME_TEXT) -> bool:
        """True if ``text`` may go out now.

        Args:
            text: What is to be said.
            now: The link's time [s].
            again: How long the same text is not repeated [s]; such a repetition counts as said.
        """
        self._recover(now)
        if now - self._said.get(text, float("-inf")) < again:
            return False
        if self._left < 1.0:
            self._withheld += 1
            return False
        self._left -= 1.0
        self._said.pop(text, None)
        self._said[text] = now
        if len(self._said) > REMEMBERED:
            del self._said[next(iter(self._said))]
        return True

    def summary(self, now: float) -> str:
        """A sentence about what was withheld, once half of the burst may go out again; else nothing."""
        self._recover(now)
        if not self._withheld or self._left < BURST / 2:
            return ""
        count, self._withheld = self._withheld, 0
        return f"{count} more answers were not said"

    def _recover(self, now: float) -> None:
        elapsed = max(now - self._since, 0.0)
        self._left = min(self._left + elapsed / RECOVERY, float(BURST))
        self._since = now
