"""An experiment is data: what the report shows of it, how it is run, and what of it came out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from sitl.studies.scenario import Figure


class Verdict(StrEnum):
    """What became of a statement of the report."""

    REPRODUCED = "reproduced"
    AS_TYPED = "only as typed"  # comes out with a slip of the report's own left in
    DIFFERS = "differs"


class Row(NamedTuple):
    """One statement of the report, the figure that checks it, and the verdict."""

    place: str  # section or figure of the report
    figure: Figure  # ``expected`` is what the report prints
    verdict: Verdict
    cause: str  # of a difference, or what the number rests on

    @property
    def explained(self) -> bool:
        """Whether a difference has its cause."""
        return self.verdict is Verdict.REPRODUCED or bool(self.cause)


class Panel(NamedTuple):
    """One figure of the report, flown again."""

    number: str  # in the report; empty if the report has no such figure
    caption: str  # the report's, in English
    claim: str  # what its text says of it
    seen: str  # what is seen here
    svg: str


class Outcome(NamedTuple):
    """What a run of an experiment left."""

    rows: list[Row]
    panels: list[Panel]


@dataclass(frozen=True)
class Experiment:
    """One experiment of the report."""

    name: str
    title: str
    place: str  # where the report has it
    text: str  # what was done, and what to make of it
    run: Callable[[int], Outcome]  # of the seed


def judge(place: str, figure: Figure, cause: str = "", *, slip: bool = False) -> Row:
    """The row of a figure: reproduced if it holds, by a slip of the report if ``slip``, else different.

    Args:
        place: Section or figure of the report.
        figure: The measured value beside the printed one.
        cause: Why it differs, or what it rests on.
        slip: Whether the value was got with a slip of the report left in.
    """
    kept = Verdict.AS_TYPED if slip else Verdict.REPRODUCED
    return Row(place, figure, kept if figure.holds else Verdict.DIFFERS, cause)
