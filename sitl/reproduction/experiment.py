"""An experiment is data: where the report has it, how it is run, and what its run found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from sitl.scenarios.scenario import Finding


class Verdict(StrEnum):
    """Whether a statement of the report holds."""

    REPRODUCED = "reproduced"
    AS_TYPED = "only as typed"  # holds only with a slip of the report's own left in
    DIFFERS = "differs"


class Statement(NamedTuple):
    """One statement of the report, the number that checks it, and the verdict."""

    place: str  # section or figure of the report
    finding: Finding  # ``expected`` is the report's printed value or claim
    verdict: Verdict
    cause: str  # of a difference, or an explanation of the number

    @property
    def is_explained(self) -> bool:
        """Whether it is reproduced, or the difference has a cause."""
        return self.verdict is Verdict.REPRODUCED or bool(self.cause)


class Panel(NamedTuple):
    """One figure of the report, drawn from our own run."""

    number: str  # in the report; empty if the report has no such figure
    caption: str  # the report's, in English
    claim: str  # of the report about it
    seen: str  # in our run
    svg: str


class ExperimentResult(NamedTuple):
    """Results of one run of an experiment."""

    statements: list[Statement]
    panels: list[Panel]


@dataclass(frozen=True)
class Experiment:
    """One experiment of the report."""

    name: str
    title: str
    place: str  # where the report has it
    text: str  # what was done, and how to read the result
    run: Callable[[int], ExperimentResult]  # of the seed
    airframes: tuple[str, ...] = ("nominal",)  # parameter sets it uses


def judge(place: str, finding: Finding, cause: str = "", *, slip: bool = False) -> Statement:
    """The statement of a finding: reproduced if it holds (by a slip of the report if ``slip``), else different.

    Args:
        place: Section or figure of the report.
        finding: The measured value beside the printed one.
        cause: Why it differs, or an explanation of the number.
        slip: Whether the value was computed with a slip of the report left in.
    """
    if_it_holds = Verdict.AS_TYPED if slip else Verdict.REPRODUCED
    return Statement(place, finding, if_it_holds if finding.holds else Verdict.DIFFERS, cause)
