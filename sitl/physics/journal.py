"""Trouble on a link: counted by kind, and said when it begins and ever more seldom after that."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable

Say = Callable[[str], None]


class Journal:
    """Counts events of one link and tells a person of them.

    Args:
        say: Takes a line for a person.
    """

    def __init__(self, say: Say) -> None:
        self.say = say
        self.counts: Counter[str] = Counter()

    def note(self, kind: str, text: str, times: int = 1) -> None:
        """Count an event, and say it if it is the first, tenth, hundredth ... of its kind.

        Args:
            kind: A word or two, in the plural: ``bad packets``.
            text: One line of what happened.
            times: How many there were at once.
        """
        before, now = self.counts[kind], self.counts[kind] + times
        self.counts[kind] = now
        if before == 0 or len(str(now)) > len(str(before)):
            self.say(text if before == 0 else f"{text} ({now} {kind} by now)")

    def tell(self, kind: str, text: str) -> None:
        """Count an event and say it, every time; for what is rare."""
        self.counts[kind] += 1
        self.say(text)

    def summary(self) -> str:
        """All counts in one line."""
        return ", ".join(f"{count} {kind}" for kind, count in sorted(self.counts.items())) or "nothing to note"


def prefixed(say: Say, name: str) -> Say:
    """The same with a name before each line."""
    return lambda text: say(name + text)


def print_line(text: str) -> None:
    """Tell a person on stderr."""
    print(f"darko-sitl physics: {text}", file=sys.stderr, flush=True)
