"""Curves of published figures as numbers, and how far one of ours is from them."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from sitl import Array

DATA = "published-curves.csv"


class Curve(NamedTuple):
    """One curve of a figure."""

    time: Array  # (n,) [s]
    value: Array  # (n,) in the figure's unit

    @property
    def range(self) -> float:
        """Largest less least value."""
        return float(np.ptp(self.value))

    def at(self, time: float) -> float:
        """Its value at a time [s]."""
        return float(np.interp(time, self.time, self.value))


@cache
def published_curves() -> Mapping[str, Mapping[str, Curve]]:
    """Curves by figure and name; times never fall, and rise by nothing where a curve jumps."""
    rows: dict[str, dict[str, list[tuple[float, float]]]] = {}
    for row in csv.DictReader(_lines()):
        rows.setdefault(row["figure"], {}).setdefault(row["curve"], []).append((float(row["t_s"]), float(row["value"])))
    return {figure: {name: _curve(points) for name, points in curves.items()} for figure, curves in rows.items()}


def _lines() -> Iterator[str]:
    text = files("sitl.lab.validation").joinpath(DATA).read_text(encoding="utf-8")
    return (line for line in text.splitlines() if not line.startswith("#"))


def _curve(points: list[tuple[float, float]]) -> Curve:
    time, value = np.array(points).T
    return Curve(time, value)


COMPARED_TIMES = 2000  # at which two curves are compared


def rms_share(published: Curve, time: Array, value: Array, *, until: float | None = None) -> float:
    """Root mean square of the difference over the time both have, as a share of the published curve's range [%].

    Args:
        published: The figure's.
        time: Of ours, (n,) [s].
        value: Ours, (n,), in the figure's unit.
        until: Where the comparison ends [s]; the end of both if not told.
    """
    end = min(published.time[-1], time[-1], np.inf if until is None else until)
    at = np.linspace(max(published.time[0], time[0]), end, COMPARED_TIMES)
    off = np.interp(at, time, value) - np.interp(at, published.time, published.value)
    return 100.0 * float(np.sqrt(np.mean(off * off))) / published.range
