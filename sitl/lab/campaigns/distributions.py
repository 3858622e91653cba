"""Distributions that a campaign draws from: by a generator, or at a share of the probability, as hypercubes ask."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from sitl.lab.campaigns.number_expressions import NumberWalker, Value
from sitl.lab.studies.wrong_models import UNCERTAIN
from sitl.tools.toml_table import TomlTable

UNIFORM, NORMAL, LOG_UNIFORM, TRIANGULAR, BY_CHOICE, BY_GRID = (
    "uniform", "normal", "log_uniform", "triangular", "choice", "grid",
)  # fmt: skip
DRAWN_KINDS = {UNIFORM: 2, NORMAL: 2, LOG_UNIFORM: 2, TRIANGULAR: 3}  # with so many numbers
DISTRIBUTION_KEYS = {*DRAWN_KINDS, BY_CHOICE, BY_GRID, "within", "along", "stream"}
AIRFRAME_DRAW = "airframe"  # the name under which the airframe's constants are drawn


class Distribution(NamedTuple):
    """One quantity's distribution.

    ``uniform`` has two bounds, ``log_uniform`` too, ``normal`` mean and standard deviation, ``triangular`` least,
    likeliest and greatest, ``choice`` and ``grid`` their values. A grid with ``along`` is no further one: it has its
    first value where that grid has its first, and so on. What has a ``stream`` is drawn by a generator of its own.
    """

    kind: str
    values: tuple[Value, ...]
    within: tuple[float, float] = (-math.inf, math.inf)  # bounds of a normal one, which is cut off there
    along: str = ""  # name of a grid that this one goes along with
    stream: int | None = None  # of the seed's generators; None: that of the case

    def drawn(self, random: np.random.Generator) -> Value:
        """A value by a generator."""
        match self.kind:
            case "uniform":
                return float(random.uniform(*self.values))  # type: ignore[arg-type]
            case "normal" if self.within == (-math.inf, math.inf):
                return float(random.normal(*self.values))  # type: ignore[arg-type]
            case "choice":
                return self.values[int(random.integers(len(self.values)))]
        return self.at(float(random.uniform()))

    def at(self, share: float) -> Value:
        """The value below which a share of the probability lies, 0..1."""
        if self.kind == BY_CHOICE:
            return self.values[min(int(share * len(self.values)), len(self.values) - 1)]
        numbers = [float(value) for value in self.values]
        first, second, more = numbers[0], numbers[1], numbers[2:]
        match self.kind:
            case "normal":
                low, high = (float(ndtr((bound - first) / second)) for bound in self.within)
                value = first + second * float(ndtri(low + (high - low) * share))
                return min(max(value, self.within[0]), self.within[1])
            case "log_uniform":
                return float(first * (second / first) ** share)
            case "triangular":
                width, left = more[0] - first, second - first
                if share * width < left:
                    return first + math.sqrt(share * width * left)
                return more[0] - math.sqrt((1.0 - share) * width * (more[0] - second))
        return first + (second - first) * share


class AirframeDraw(NamedTuple):
    """Constants of the airframe that are drawn: off by a share of themselves, or within an interval."""

    relative: float  # greatest error of those named, 0 if none
    constants: tuple[str, ...]
    intervals: dict[str, tuple[float, float]]  # by constant [SI]

    @property
    def size(self) -> int:
        """Numbers that are drawn."""
        return len(self.constants) + len(self.intervals)

    def at(self, shares: Sequence[float]) -> tuple[dict[str, float], dict[str, float]]:
        """Factor of each constant, and value of each one with an interval, at shares of the probability."""
        errors, placed = shares[: len(self.constants)], shares[len(self.constants) :]
        factors = {k: 1.0 + (2.0 * u - 1.0) * self.relative for k, u in zip(self.constants, errors, strict=True)}
        return factors, {k: a + (b - a) * u for (k, (a, b)), u in zip(self.intervals.items(), placed, strict=True)}

    def drawn(self, random: np.random.Generator) -> tuple[dict[str, float], dict[str, float]]:
        """The same by a generator."""
        factors = {k: 1.0 + float(random.uniform(-1.0, 1.0)) * self.relative for k in self.constants}
        return factors, {k: float(random.uniform(*interval)) for k, interval in self.intervals.items()}


def distribution_of(table: TomlTable, given: dict[str, Any]) -> Distribution:
    """A distribution as it is written, such as ``{ uniform = [0.0, 5.0] }``.

    Raises:
        SitlError: It has no kind or several, or its numbers do not fit.
    """
    kinds = [kind for kind in (*DRAWN_KINDS, BY_CHOICE, BY_GRID) if kind in given]
    if len(kinds) != 1:
        raise table.error("", f"must have one of {', '.join((*DRAWN_KINDS, BY_CHOICE, BY_GRID))}")
    kind, values = kinds[0], given[kinds[0]]
    if not isinstance(values, list) or not values:
        raise table.error(kind, "must be values in brackets")
    if kind in {BY_CHOICE, BY_GRID}:
        if any(isinstance(value, bool) or not isinstance(value, int | float | str) for value in values):
            raise table.error(kind, "must be numbers or words")
        along = table.text("along") if table.has("along") else ""
        if along and kind != BY_GRID:
            raise table.error("along", "is of grids")
        words = tuple(value if isinstance(value, str) else float(value) for value in values)
        return Distribution(kind, words, along=along, stream=_stream(table))
    numbers = tuple(_bound(table, kind, value) for value in values)
    if len(numbers) != DRAWN_KINDS[kind]:
        raise table.error(kind, f"must be {DRAWN_KINDS[kind]} numbers in brackets")
    within = (-math.inf, math.inf)
    if "within" in given:
        within = tuple(table.numbers("within", 2, -1e12, 1e12))  # type: ignore[assignment]
    flaw = _flaw(kind, numbers, within)
    if flaw:
        raise table.error(kind, flaw)
    return Distribution(kind, numbers, within, stream=_stream(table))


def _stream(table: TomlTable) -> int | None:
    return int(table.number("stream", 0, 2**31)) if table.has("stream") else None


def _bound(table: TomlTable, kind: str, value: object) -> float:
    """A number of a distribution, or one such as ``"2 * pi"``."""
    number = NumberWalker({}).number(value) if isinstance(value, str) else value
    if isinstance(number, bool) or not isinstance(number, int | float) or not math.isfinite(number):
        raise table.error(kind, f"has {value!r}, which is not a finite number")
    return float(number)


def _flaw(kind: str, numbers: tuple[float, ...], within: tuple[float, float]) -> str:
    """The reason why numbers make no distribution; empty if they make one."""
    if kind == NORMAL:
        if numbers[1] <= 0.0:
            return "needs a standard deviation above 0"
        return "" if within[0] < within[1] else "needs 'within' to ascend"
    if within != (-math.inf, math.inf):
        return "has no 'within': only normal is cut off"
    if list(numbers) != sorted(numbers) or (numbers[0] == numbers[-1] and kind != UNIFORM):
        return f"= {list(numbers)} must ascend"
    return "needs bounds above 0" if kind == LOG_UNIFORM and numbers[0] <= 0.0 else ""


def airframe_draw_of(table: TomlTable, given: dict[str, Any], constants: Sequence[str]) -> AirframeDraw:
    """The airframe's constants as they are drawn: ``{ relative = 0.1, of = ["m", "k_f"], intervals.k_h = [1, 2] }``.

    Args:
        table: Of the file.
        given: The same, unchecked.
        constants: That an airframe has.

    Raises:
        SitlError: It names a constant that is none, or draws nothing.
    """
    relative = table.number("relative", 0.0, 0.9, 0.0)
    named = given.get("of", list(UNCERTAIN) if "relative" in given else [])
    intervals = given.get("intervals", {})
    if not isinstance(named, list) or not isinstance(intervals, dict) or not (named or intervals):
        raise table.error("", "needs 'relative', with 'of' for some constants only, or 'intervals'")
    for name in (*named, *intervals):
        if name not in constants:
            raise table.error("", f"names {name!r}, which is no constant of an airframe (darko-sitl airframe)")
    bounds = TomlTable("", intervals, "", set(intervals))
    found = {name: bounds.numbers(name, 2, -1e9, 1e9) for name in intervals}
    for name, (low, high) in found.items():
        if low >= high:
            raise table.error("intervals", f"has {name} = [{low:g}, {high:g}], which does not ascend")
    return AirframeDraw(relative, tuple(named), {name: (low, high) for name, (low, high) in found.items()})
