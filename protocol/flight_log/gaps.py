"""Gaps of a series: where messages lacked, nothing is known, and no line is drawn."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

__all__ = ["between", "longest_step", "pieces", "with_gaps"]

Floats = NDArray[np.float64]

MIN_GAP = 2.0  # [s] a shorter silence is none
USUAL_STEPS = 5.0  # of the usual time between two messages: a longer silence is a gap


def longest_step(times: Floats) -> float:
    """Time between two neighbours from which on there is a gap [s]; ``times`` ascend."""
    steps = np.diff(times)
    return max(MIN_GAP, USUAL_STEPS * float(np.median(steps))) if len(steps) else MIN_GAP


def between(wanted: Floats, times: Floats, values: Floats) -> Floats:
    """Values at other times, in between in proportion; NaN in gaps, and as far outside.

    Args:
        wanted: Times [s], shape (n,).
        times: Of the values [s], ascending, shape (m,).
        values: Shape (m,).
    """
    longest = longest_step(times)
    after = np.searchsorted(times, wanted)
    left = times[np.maximum(after - 1, 0)]
    right = times[np.minimum(after, len(times) - 1)]
    is_known = np.where(
        (after == 0) | (after == len(times)),
        np.minimum(np.abs(wanted - left), np.abs(wanted - right)) <= longest,
        (right - left <= longest) | (wanted == right),
    )
    return np.where(is_known, np.interp(wanted, times, values), np.nan)


def pieces(times: Floats) -> list[slice]:
    """The parts of a series between its gaps; ``times`` ascend."""
    edges = [0, *(np.flatnonzero(np.diff(times) > longest_step(times)) + 1).tolist(), len(times)]
    return [slice(begin, end) for begin, end in pairwise(edges)]


def with_gaps(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """The series with a NaN in each gap, which breaks a drawn line; shapes (n,) and (n,) or (n, k)."""
    rows = np.flatnonzero(np.diff(times) > longest_step(times)) + 1
    middle = (times[rows] + times[rows - 1]) / 2.0
    return np.insert(times, rows, middle), np.insert(values.astype(np.float64), rows, np.nan, axis=0)
