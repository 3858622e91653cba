"""An experiment is data: where the report has it, how it is run, and what its run found."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from sitl import Airframe, load_airframe

# Values that the report prints, each as the interval of numbers that would be printed so.


EDGE = 1e-9  # relative: a number on the edge of the interval lies in it


class Expectation(NamedTuple):
    """A printed number or statement, and which numbers agree with it."""

    text: str  # as the report has it
    low: float
    high: float
    reading: str  # how the interval follows from the text

    def holds(self, value: float) -> bool:
        """Whether a number would be printed so; NaN never is."""
        slack = EDGE * max(1.0, abs(value)) if math.isfinite(self.high - self.low + value) else 0.0
        return self.low - slack <= value <= self.high + slack


def printed(text: str) -> Expectation:
    """A printed number: half a unit of its last digit either way.

    Raises:
        ValueError: If the text is not a decimal number.
    """
    value, half = float(text), 0.5 * 10.0 ** -len(text.partition(".")[2])
    return Expectation(text, value - half, value + half, f"± {half:g}")


def printed_to_ten(text: str) -> Expectation:
    """A printed whole number whose last zero is no digit."""
    return Expectation(text, float(text) - 5.0, float(text) + 5.0, "± 5: read to the ten")


def all_of(count: int) -> Expectation:
    """So many of so many."""
    return Expectation(f"all {count}", float(count), float(count), "each to its last printed digit")


def below(bound: float, text: str) -> Expectation:
    """A statement that says less than a number."""
    return Expectation(text, -math.inf, math.nextafter(bound, -math.inf), f"< {bound:g}")


def above(bound: float, text: str) -> Expectation:
    """A statement that says more than a number."""
    return Expectation(text, math.nextafter(bound, math.inf), math.inf, f"> {bound:g}")


# Differences from the report without a cause that could be computed: listed with their numbers, and counted.
#
# A statement whose number leaves the interval listed here is unexplained again.


class OpenDifference(NamedTuple):
    """One of them."""

    found: Expectation  # our number, to the digits given
    why_open: str


OPEN_DIFFERENCES = {
    "pseudo-inverse of M_b, delta T by yaw": OpenDifference(
        printed("1.51"),
        "With the slip of its neighbours, the motors' arm alone, it is 1.497: 0.002 beyond half a unit of the printed "
        "digit. The constants of the report's public source code give the same 1.497.",
    ),
    "path of the steady climb in which the motors turn at 661 rad/s": OpenDifference(
        printed("51.1"),
        "The report says 45. At v_bx = 20 m/s its two printed numbers, 54 deg and 661 rad/s, belong together, but to a "
        "path some five degrees steeper. Neither the gains nor the time of reading are printed, so why the path is "
        "steeper cannot be computed.",
    ),
}


REPORT_SET = "published"  # the constants behind the report's printed numbers, in the report's own model


class Verdict(StrEnum):
    """Verdict on a statement, as its numbers give it; nobody chooses it."""

    REPRODUCED = "reproduced"
    CAUSE_COMPUTED = "differs, cause computed"  # computed again with one thing changed, it is what the report prints
    OPEN = "open difference"  # listed with its number
    UNEXPLAINED = "unexplained"


class Kind(StrEnum):
    """Worth of agreement with a statement."""

    NUMBER = "numbers derived again"
    CLAIM = "statements that say less than a number"
    INPUT = "inputs repeated"  # the number is a parameter of the model
    FITTED = "numbers that constants were fitted to"


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
    is_input: bool = False  # the published number is one of the model's own parameters
    is_fitted: bool = False  # constants of the model were chosen by it
    is_claim: bool = False  # a number stands for words, as 0 for "is reached"
    open: OpenDifference | None = None  # listed with the statement itself

    @property
    def kind(self) -> Kind:
        """Whether a number is derived again, words hold, or what was put in comes back."""
        if self.is_input or self.is_fitted:
            return Kind.INPUT if self.is_input else Kind.FITTED
        return Kind.CLAIM if self.is_claim or math.isinf(self.expected.high - self.expected.low) else Kind.NUMBER

    @property
    def open_difference(self) -> OpenDifference | None:
        """Its entry in the list of open differences, if the difference still is the listed one."""
        listed = self.open or OPEN_DIFFERENCES.get(self.name)
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
