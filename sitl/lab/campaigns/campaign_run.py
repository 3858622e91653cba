"""A campaign run: chunks flown that are missing, progress, and an end that is the same whoever flew and when."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from sitl.lab.campaigns.case_flights import FlownCase
from sitl.lab.campaigns.chunks import ChunkStore, results_of
from sitl.lab.campaigns.engines import Engine
from sitl.lab.campaigns.specification import Specification
from sitl.lab.studies.proportions import CONFIDENCE, share_bounds

PROGRESS_TIME = 5.0  # between two lines of progress [s]
SECONDS_A_MINUTE, SECONDS_AN_HOUR = 60.0, 3600.0


class CampaignResult(NamedTuple):
    """The cases of a campaign in their order, and whether its early end came."""

    specification: Specification
    flown: list[FlownCase]
    ended_early: bool

    def values(self, measure: str) -> list[float]:
        """A measure of all cases; NaN where there is none."""
        at = list(self.specification.measures).index(measure)
        return [flown.measures[at] for flown in self.flown]


class Progress:
    """Lines about a run: cases done, their rate, time left, errors.

    Args:
        cases: Of the whole campaign.
        done: Of these, from an earlier run.
        clock: Seconds, from any beginning.
        write: Takes a line.
    """

    def __init__(self, cases: int, done: int, clock: Callable[[], float], write: Callable[[str], None]) -> None:
        self._cases, self._done, self._clock, self._write = cases, done, clock, write
        self._began = self._told = clock()
        self._new = self._errors = 0

    def add(self, flown: Sequence[FlownCase]) -> None:
        """Count cases that were flown, and tell of them now and then."""
        self._new += len(flown)
        self._errors += sum(bool(one.error) for one in flown)
        now = self._clock()
        if now - self._told >= PROGRESS_TIME or self._done + self._new == self._cases:
            self._told = now
            self._write(self.line(now - self._began))

    def line(self, seconds: float) -> str:
        """The line after so many seconds."""
        done, rate = self._done + self._new, self._new / max(seconds, 1e-9)
        errors = f", {self._errors} with an error" if self._errors else ""
        left = in_words((self._cases - done) / rate) if rate else "no end in sight"
        return f"{done}/{self._cases} cases, {SECONDS_A_MINUTE * rate:.0f} a minute, {left} left{errors}"


def in_words(seconds: float) -> str:
    """A time such as ``2 h 5 min``."""
    if seconds < SECONDS_A_MINUTE:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(round(seconds / SECONDS_A_MINUTE), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


def print_line(line: str) -> None:
    """A line on the standard error."""
    print(line, file=sys.stderr, flush=True)


def run_specification(
    specification: Specification,
    store: ChunkStore,
    engine: Engine,
    clock: Callable[[], float] = time.monotonic,
    write: Callable[[str], None] = print_line,
) -> CampaignResult:
    """Fly what is missing of a campaign; the result depends neither on the engine nor on what was there before.

    Args:
        specification: The campaign.
        store: Its folder.
        engine: Flies the chunks.
        clock: Seconds, from any beginning.
        write: Takes lines of progress.

    Raises:
        SitlError: A chunk cannot be written, or the engine cannot go on; what was flown stays.
    """
    known = {cases: found for cases in specification.chunks if (found := store.read(cases)) is not None}
    end = EarlyEndWatch(specification)
    missing = [cases for cases in specification.chunks if cases not in known]
    if end.has_come(known) or not missing:
        return end.result(known)
    progress = Progress(specification.cases, sum(map(len, known.values())), clock, write)
    with closing(engine(specification, missing)) as flights:
        for cases, data in flights:
            store.write(cases, data)
            known[cases] = results_of(data)
            progress.add(known[cases])
            if end.has_come(known):
                break
    return end.result(known)


class EarlyEndWatch:
    """Looks, after each chunk in their order, whether the campaign may end: so its end depends on nobody's speed.

    Args:
        specification: The campaign.
    """

    def __init__(self, specification: Specification) -> None:
        self._specification = specification
        self._chunks = specification.chunks
        self._looked = 0  # at so many of them
        self._values: list[float] = []
        self._is_over = False

    def has_come(self, known: Mapping[range, Sequence[FlownCase]]) -> bool:
        """Whether the campaign may end with the chunks that are known.

        Args:
            known: Results by chunk.
        """
        end = self._specification.early_end
        if end is None:
            return False
        at = list(self._specification.measures).index(end.measure)
        judges = self._specification.measures[end.measure].is_judgement
        while not self._is_over and self._looked < len(self._chunks) and self._chunks[self._looked] in known:
            self._values += [flown.measures[at] for flown in known[self._chunks[self._looked]]]
            self._looked += 1
            if len(self._values) >= end.least:
                self._is_over = interval_width(self._values, judges=judges) <= end.width
        return self._is_over

    def result(self, known: Mapping[range, Sequence[FlownCase]]) -> CampaignResult:
        """The cases up to the end."""
        chunks = self._chunks[: self._looked] if self._is_over else self._chunks
        flown = [one for cases in chunks for one in known[cases]]
        return CampaignResult(self._specification, flown, ended_early=self._is_over)


def interval_width(values: Sequence[float], *, judges: bool) -> float:
    """Width of the 95 % interval of a share (Clopper and Pearson's), or of a mean (Student's).

    Args:
        values: Of the cases; what is not finite does not count.
        judges: Whether they are 1 and 0.
    """
    finite = np.array(values)[np.isfinite(values)]
    if len(finite) < 2:
        return math.inf
    if judges:
        low, high = share_bounds(int(finite.sum()), len(finite))
        return high - low
    quantile = float(stdtrit(len(finite) - 1, 0.5 + 0.5 * CONFIDENCE))
    return 2.0 * quantile * float(finite.std(ddof=1)) / math.sqrt(len(finite))
