"""An experiment is data: where the report has it, how it is run, and what its run found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from sitl import Airframe, load_airframe
from sitl.lab.reproduction.expectation import Expectation
from sitl.lab.reproduction.open_differences import OPEN_DIFFERENCES, OpenDifference

REPORT_SET = "published"  # the constants behind the report's printed numbers, in the report's own model


class Verdict(StrEnum):
    """Verdict on a statement, as its numbers give it; nobody chooses it."""

    REPRODUCED = "reproduced"
    CAUSE_COMPUTED = "differs, cause computed"  # computed again with one thing changed, it is what the report prints
    OPEN = "open difference"  # listed with its number
    UNEXPLAINED = "unexplained"


class Recomputation(NamedTuple):
    """The same number with one thing changed: a slip of the report switched on, or one of its formulas corrected."""

    change: str
    value: float


@dataclass(frozen=True)
class Statement:
    """One statement of the report that can be tested, and the number that tests it."""

    place: str  # section or figure of the report
    name: str
    expected: Expectation
    value: float
    unit: str = ""
    cause: Recomputation | None = None  # why it differs, if it does
    note: str = ""

    @property
    def open_difference(self) -> OpenDifference | None:
        """Its entry in the list of open differences, if the difference still is the listed one."""
        listed = OPEN_DIFFERENCES.get(self.name)
        return listed if listed is not None and listed.found.holds(self.value) else None

    @property
    def verdict(self) -> Verdict:
        """The comparison of the printed with the computed number."""
        if self.expected.holds(self.value):
            return Verdict.REPRODUCED
        if self.cause is not None and self.expected.holds(self.cause.value):
            return Verdict.CAUSE_COMPUTED
        return Verdict.OPEN if self.open_difference is not None else Verdict.UNEXPLAINED


class Illustration(NamedTuple):
    """A number beside a statement that no number can test: the report leaves out what it depends on."""

    place: str
    name: str
    value: float
    unit: str
    report: str  # what the report says
    text: str  # what the number shows, and what the report leaves out


class Panel(NamedTuple):
    """One figure of the report, drawn from our own run."""

    number: str  # in the report; empty if the report has no such figure
    caption: str  # the report's, in English
    claim: str  # of the report about it
    seen: str  # in our run
    svg: str


class EntryTable(NamedTuple):
    """Printed numbers, one a row, beside those computed."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


class ExperimentResult(NamedTuple):
    """Results of one run of an experiment."""

    statements: list[Statement]
    panels: list[Panel]
    illustrations: Sequence[Illustration] = ()
    tables: Sequence[EntryTable] = ()


class Conditions(NamedTuple):
    """Under which an experiment is run."""

    seed: int = 1
    factors: tuple[tuple[str, float], ...] = ()  # by which parameters of every airframe are multiplied

    def airframe(self, name: str) -> Airframe:
        """The parameters of a set."""
        parameters = load_airframe(name).parameters
        return parameters._replace(**{key: factor * getattr(parameters, key) for key, factor in self.factors})


@dataclass(frozen=True)
class Experiment:
    """One experiment of the report."""

    name: str
    title: str
    place: str  # where the report has it
    text: str  # what was done, and how to read the result
    run: Callable[[Conditions], ExperimentResult]
    airframes: tuple[str, ...] = (REPORT_SET,)  # parameter sets it uses


def failures(statements: Sequence[Statement]) -> list[Statement]:
    """Those that no computed cause and no listed difference explains."""
    return [statement for statement in statements if statement.verdict is Verdict.UNEXPLAINED]
