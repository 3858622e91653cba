"""When to send again and when to give up: the clock of every transfer.

How long an answer takes is measured, and the wait for one follows it (RFC 6298). Only an answer to something sent once
is measured, for of what was sent twice nobody knows which copy was answered; a longer wait stays until then (Karn).
A transfer lives as long as the other side is heard at all and anything of it moves, so a bad link is endured and
a dead one noticed.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

from protocol.codec import Message

__all__ = ["FIRST", "LATE", "LEAST", "MOST", "SILENCE", "STALL", "Mark", "Partner", "Resend", "Window", "precedes"]

FIRST = 1.0  # [s] wait for an answer before any was measured
LEAST, MOST = 0.25, 1.5  # [s] shortest and longest wait; what the mission protocol recommends for items and the rest
SILENCE = 10.0  # [s] without a single frame after which the other side is gone
STALL = 30.0  # [s] without progress after which it is there, but will not answer any more
LATE = 2.0  # [s] a frame may arrive after a later one; sequence numbers wrap too soon to look further back
OVERTAKEN = 3  # answers to later questions after which an earlier one counts as lost


class Mark(NamedTuple):
    """A moment in what the other side says."""

    newest: int | None  # the number of the last frame before it; None: it had said nothing
    at: float  # [s]


class Partner:
    """The other side: when it was heard, in what order it spoke, and how long its answers take.

    All engines of one end share it.

    Args:
        first: Wait for an answer before any was measured [s].
    """

    def __init__(self, first: float = FIRST) -> None:
        self.heard = -math.inf  # when its last frame came [s]
        self.newest: int | None = None  # the number of its newest frame, counted on beyond 255
        self.timeout = first  # [s] to wait for an answer
        self._mean: float | None = None
        self._deviation = 0.0

    def hear(self, message: Message, now: float) -> None:
        """A frame of it came, whatever it says."""
        self.heard = now
        number = self.number(message)
        self.newest = number if self.newest is None else max(self.newest, number)

    def number(self, message: Message) -> int:
        """The place of a frame among all it sent, as long as not half of the 256 sequence numbers went missing."""
        sequence = int(message.get_seq())
        if self.newest is None:
            return sequence
        ahead = (sequence - self.newest) & 0xFF
        return self.newest + ahead - (256 if ahead > 127 else 0)

    def mark(self, now: float) -> Mark:
        """This moment, to tell later what was said before it."""
        return Mark(self.newest, now)

    def said_before(self, mark: Mark, message: Message, now: float) -> bool:
        """True for a frame that was sent before a moment: late or a duplicate, it cannot answer what came after."""
        return mark.newest is not None and now - mark.at < LATE and self.number(message) <= mark.newest

    def measure(self, seconds: float) -> None:
        """An answer took that long."""
        if self._mean is None:
            self._mean, self._deviation = seconds, seconds / 2
        else:
            self._deviation += (abs(seconds - self._mean) - self._deviation) / 4
            self._mean += (seconds - self._mean) / 8
        self.timeout = min(max(self._mean + 4 * self._deviation, LEAST), MOST)

    def miss(self) -> None:
        """An answer did not come in time."""
        self.timeout = min(2 * self.timeout, MOST)


class _Endurance:
    """How long a transfer is kept up."""

    def __init__(self, partner: Partner) -> None:
        self._partner, self._moved = partner, -math.inf

    def progress(self, now: float) -> None:
        self._moved = now

    def is_over(self, now: float) -> bool:
        return now - max(self._moved, self._partner.heard) >= SILENCE or now - self._moved >= STALL


class Resend:
    """One message that is sent until the next step is reached."""

    def __init__(self, partner: Partner) -> None:
        self.deadline = math.inf  # when to send again
        self.times = 0  # it was sent without being answered
        self._partner, self._endurance = partner, _Endurance(partner)
        self._sent = 0.0

    def start(self, now: float) -> None:
        """The next step: its message goes out for the first time."""
        self._sent, self.times = now, 1
        self._endurance.progress(now)
        self.deadline = now + self._partner.timeout

    def answer(self, now: float) -> None:
        """What was sent has been answered."""
        if self.times == 1:
            self._partner.measure(now - self._sent)
        self.times = 0

    def wait(self, now: float) -> None:
        """More is on its way without being asked for."""
        self._endurance.progress(now)
        self.deadline = now + self._partner.timeout

    def retry(self, now: float) -> bool:
        """The deadline passed: True: send again; False: give up."""
        if self._endurance.is_over(now):
            self.stop()
            return False
        self.times += 1
        self._partner.miss()
        self.deadline = now + self._partner.timeout
        return True

    def stop(self) -> None:
        """Nothing is waited for."""
        self.deadline = math.inf


@dataclass(slots=True)
class _Question:
    order: int  # its place among all that were asked
    at: float  # when it was asked last [s]
    until: float  # when it is asked again [s]
    times: int
    passed: int = 0  # answers to questions asked since


class Window:
    """Numbered things that are asked for several at a time, each again when it does not come.

    Args:
        partner: Who is asked.
        missing: What is wanted, in this order.
        size: How many questions may be open.
        now: Time [s].
    """

    def __init__(self, partner: Partner, missing: Iterable[int], size: int, now: float) -> None:
        self.missing = dict.fromkeys(missing)
        self._partner, self._endurance, self._size = partner, _Endurance(partner), size
        self._endurance.progress(now)
        self._open: dict[int, _Question] = {}
        self._asked = 0

    @property
    def deadline(self) -> float:
        """When something must be asked for again."""
        return min((question.until for question in self._open.values()), default=math.inf)

    def take(self, number: int, now: float) -> bool:
        """One came; False: it was not missing."""
        if number not in self.missing:
            return False
        del self.missing[number]
        self._endurance.progress(now)
        question = self._open.pop(number, None)
        if question is not None:
            if question.times == 1:
                self._partner.measure(now - question.at)
            for other in self._open.values():
                other.passed += other.order < question.order
        return True

    def ask(self, now: float) -> list[int]:
        """What is to be asked for now."""
        late = [number for number, question in self._open.items() if now >= question.until]
        if late:
            self._partner.miss()
        again = [n for n, question in self._open.items() if n in late or question.passed >= OVERTAKEN]
        room = max(self._size - len(self._open), 0)
        wanted = again + list(islice((n for n in self.missing if n not in self._open), room))
        for number in wanted:
            times = self._open[number].times if number in self._open else 0
            self._asked += 1
            self._open[number] = _Question(self._asked, now, now + self._partner.timeout, times + 1)
        return wanted

    def is_over(self, now: float) -> bool:
        """True when there is no hope any more."""
        return self._endurance.is_over(now)


def precedes(earlier: int, later: int) -> bool:
    """True when of two sequence numbers (0..255) of one sender the first was used first."""
    return 0 < (later - earlier) & 0xFF < 128
