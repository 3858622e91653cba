"""The reference flights, flown in every way there is, and one hash over every bit of what became of them.

``python -m tests.support.digests.reference_digest alone batch short`` prints a hash of each way of flying them.
"""

import hashlib
import sys
from itertools import cycle
from typing import NamedTuple

from protocol.dialect.vocabulary import Law
from sitl.sensors.draws import PERIOD
from sitl.simulation.batch import fly_batch
from sitl.simulation.start import whole_periods
from tests.support.digests.reference_flights import FLIGHTS, SHORT

SMALL = 1, 3, 7, 50, 2, 333  # control periods


class Flown(NamedTuple):
    """Result of one flight, to the bit."""

    name: str
    state: bytes  # the whole record, but for:
    limits: int  # actuator limits it met; the record's are those since the last call
    jumps: tuple[str, ...]
    laws: tuple[Law, ...]  # under which it was flown


def alone(flights, periods):
    """Each by itself, as far as nothing is asked of any."""
    for flight in flights:
        flight.advance(periods)
    yield


def in_small_calls(flights, periods):
    """Each by itself, in calls of all lengths."""
    lengths = cycle(SMALL)
    while periods > 0:
        now = min(next(lengths), periods)
        periods -= now
        for flight in flights:
            flight.advance(now)
        yield


def in_batch(flights, periods):
    """All of them side by side."""
    fly_batch(flights, periods * PERIOD)
    yield


class Run:
    """One flight on its way."""

    def __init__(self, flight, seconds):
        self.flight, self.end = flight, whole_periods(seconds or flight.seconds)
        self.made = flight.begin()
        self.begun, self.limits = self.made.law, 0

    def ask(self):
        """Make the requests that are due now."""
        for ask in self.flight.asks:
            if whole_periods(ask.time) == self.made.periods:
                ask.do(self.made)

    def flown(self):
        """Result of the flight."""
        self.made._arrays.flights["limits"] = 0
        numbers = (tuple(float(x).hex() if isinstance(x, float) else x for x in jump) for jump in self.made.jumps)
        jumps = tuple(" ".join(str(x) for x in jump) for jump in numbers)
        return Flown(self.flight.name, self.made._arrays.flights.tobytes(), self.limits, jumps, self.laws())

    def laws(self):
        """Under which a control period was flown."""
        began = [(0.0, self.begun), *((jump.time, jump.target) for jump in self.made.jumps)]
        ends = [*(time for time, _ in began[1:]), self.made.time]
        return tuple(law for (time, law), end in zip(began, ends, strict=True) if end > time)


def fly(move, seconds=None):
    """Fly all of them.

    Args:
        move: How: a generator of flights and control periods, which yields after every call.
        seconds: Of each; all of it by default.
    """
    runs = [Run(flight, seconds) for flight in FLIGHTS]
    asked = {whole_periods(ask.time) for flight in FLIGHTS for ask in flight.asks}
    last, now = max(run.end for run in runs), 0
    for stop in sorted(time for time in asked | {run.end for run in runs} if 0 < time <= last):
        going = [run for run in runs if run.end > now]
        for run in going:
            run.ask()
        for _ in move([run.made for run in going], stop - now):
            for run in going:
                run.limits |= run.made.limits
        now = stop
    return [run.flown() for run in runs]


def digest(flown):
    """One hash over all of them."""
    return hashlib.sha256(repr(flown).encode()).hexdigest()


WAYS = {
    "alone": lambda: fly(alone),
    "small calls": lambda: fly(in_small_calls),
    "batch": lambda: fly(in_batch),
    "short": lambda: fly(alone, SHORT),
}


if __name__ == "__main__":
    for way in sys.argv[1:]:
        print(digest(WAYS[way]()))
