"""Numbers known to lie in intervals, with bounds of their first and second derivatives: differentiation over boxes.

A proof by :mod:`sitl.lab.proofs.lagged` writes the plant in such numbers, so that bounds of every entry of its
Jacobian, and of how that changes, follow from the equations themselves. Rounding is not outwards.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from sitl import Array

Ends: TypeAlias = tuple[Array, Array]  # least and greatest


def times(a: Ends, b: Ends) -> Ends:
    """Bounds of the product of two intervals."""
    ends = (a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1])
    least = np.minimum(np.minimum(ends[0], ends[1]), np.minimum(ends[2], ends[3]))
    return least, np.maximum(np.maximum(ends[0], ends[1]), np.maximum(ends[2], ends[3]))


def _sum(*parts: Ends) -> Ends:
    low, high = parts[0]
    for part in parts[1:]:
        low, high = low + part[0], high + part[1]
    return low, high


def _outer(a: Ends, b: Ends) -> Ends:
    return times((a[0][:, :, None], a[1][:, :, None]), (b[0][:, None, :], b[1][:, None, :]))


def _spread(value: Ends, axes: int) -> Ends:
    """An interval per box beside arrays of so many more axes."""
    low, high = (end.reshape(end.shape + (1,) * axes) for end in value)
    return low, high


class Bounded:
    """A quantity on each of n boxes: bounds of its value, (n,), gradient, (n, k), and second derivatives, (n, k, k)."""

    def __init__(self, value: Ends, slope: Ends, bend: Ends) -> None:
        self.value, self.slope, self.bend = value, slope, bend

    @classmethod
    def variable(cls, low: Array, high: Array, place: int, count: int) -> Bounded:
        """One of the variables."""
        slope = np.zeros((len(low), count))
        slope[:, place] = 1.0
        none = np.zeros((len(low), count, count))
        return cls((low, high), (slope, slope), (none, none))

    def __add__(self, other: Bounded | float) -> Bounded:
        if isinstance(other, Bounded):
            parts = ((self.value, other.value), (self.slope, other.slope), (self.bend, other.bend))
            value, slope, bend = (_sum(*pair) for pair in parts)
            return Bounded(value, slope, bend)
        return Bounded((self.value[0] + other, self.value[1] + other), self.slope, self.bend)

    __radd__ = __add__

    def __neg__(self) -> Bounded:
        return self * -1.0

    def __sub__(self, other: Bounded | float) -> Bounded:
        return self + other * -1.0

    def __rsub__(self, other: float) -> Bounded:
        return self * -1.0 + other

    def __mul__(self, other: Bounded | float) -> Bounded:
        if isinstance(other, Bounded):
            slope = _sum(times(_spread(self.value, 1), other.slope), times(_spread(other.value, 1), self.slope))
            crossed = _outer(self.slope, other.slope)
            turned = (crossed[0].swapaxes(1, 2), crossed[1].swapaxes(1, 2))
            own = times(_spread(self.value, 2), other.bend), times(_spread(other.value, 2), self.bend)
            return Bounded(times(self.value, other.value), slope, _sum(*own, crossed, turned))
        first, second = (0, 1) if other >= 0.0 else (1, 0)
        parts = (self.value, self.slope, self.bend)
        value, slope, bend = ((part[first] * other, part[second] * other) for part in parts)
        return Bounded(value, slope, bend)

    __rmul__ = __mul__

    def by(self, value: Ends, rate: Ends, second: Ends) -> Bounded:
        """A function of it: bounds of its value and of its two derivatives."""
        bend = _sum(times(_spread(rate, 2), self.bend), times(_spread(second, 2), _outer_square(self.slope)))
        return Bounded(value, times(_spread(rate, 1), self.slope), bend)

    def square(self) -> Bounded:
        """Its square."""
        low, high = self.value
        least = np.where((low < 0.0) & (high > 0.0), 0.0, np.minimum(low * low, high * high))
        two = np.full_like(low, 2.0)
        return self.by((least, np.maximum(low * low, high * high)), (2.0 * low, 2.0 * high), (two, two))

    def signed_square(self) -> Bounded:
        """Itself times its size."""
        low, high = self.value
        sizes = np.stack([np.abs(low), np.abs(high)])
        least = np.where((low < 0.0) & (high > 0.0), 0.0, sizes.min(0))
        second = (np.where(low >= 0.0, 2.0, -2.0), np.where(high <= 0.0, -2.0, 2.0))
        return self.by((low * np.abs(low), high * np.abs(high)), (2.0 * least, 2.0 * sizes.max(0)), second)

    def sqrt(self) -> Bounded:
        """The root of a positive quantity; NaN where it may not be."""
        low, high = (np.sqrt(np.where(end > 0.0, end, np.nan)) for end in self.value)
        return self.by((low, high), (0.5 / high, 0.5 / low), (-0.25 / low**3, -0.25 / high**3))

    def inverse(self) -> Bounded:
        """One over a positive quantity; NaN where it may not be."""
        high, low = (1.0 / np.where(end > 0.0, end, np.nan) for end in self.value)
        return self.by((low, high), (-high * high, -low * low), (2.0 * low**3, 2.0 * high**3))


def _outer_square(slope: Ends) -> Ends:
    """A gradient times itself: squares are not negative."""
    low, high = _outer(slope, slope)
    places = np.arange(low.shape[1])
    low[:, places, places] = np.where(
        (slope[0] < 0.0) & (slope[1] > 0.0), 0.0, np.minimum(slope[0] ** 2, slope[1] ** 2)
    )
    return low, high


def larger(a: Bounded, b: Bounded) -> Bounded:
    """The larger of two that have the same gradient where they are equal."""
    parts = []
    for first, second in ((a.value, b.value), (a.slope, b.slope), (a.bend, b.bend)):
        shape = (-1, *(1,) * (first[0].ndim - 1))
        only_a = (a.value[0] > b.value[1]).reshape(shape)
        only_b = (b.value[0] > a.value[1]).reshape(shape)
        low = np.where(only_a, first[0], np.where(only_b, second[0], np.minimum(first[0], second[0])))
        high = np.where(only_a, first[1], np.where(only_b, second[1], np.maximum(first[1], second[1])))
        parts.append((low, high))
    value = (np.maximum(a.value[0], b.value[0]), np.maximum(a.value[1], b.value[1]))
    return Bounded(value, parts[1], parts[2])


class Table:
    """A function of one variable between its ends: bounds of it and of three derivatives on intervals.

    The derivatives are central differences of one another on a fine grid; between two points a derivative is at most
    half a step times the next one's largest off those there.
    """

    def __init__(self, x: Array, value: Array) -> None:
        self.x, self.step = x, float(x[1] - x[0])
        self.rows = [value]
        for _ in range(3):
            self.rows.append(np.gradient(self.rows[-1], self.step, edge_order=2))
        self.off = [0.5 * self.step * float(np.abs(row).max()) for row in self.rows[1:]]
        self.off.append(0.05 * float(np.abs(self.rows[3]).max()))  # nothing is told of the fourth

    def on(self, low: Array, high: Array, order: int) -> Ends:
        """Bounds of a derivative; NaN outside the table."""
        row, made = self.rows[order], np.full((2, len(low)), np.nan)
        first = np.floor((low - self.x[0]) / self.step)
        last = np.ceil((high - self.x[0]) / self.step)
        for k in np.flatnonzero((first >= 0.0) & (last < len(row))):
            part = row[int(first[k]) : int(last[k]) + 1]
            made[:, k] = part.min() - self.off[order], part.max() + self.off[order]
        return made[0], made[1]


def paired(table: Table, middle: Bounded, way: Bounded, sign: float) -> Bounded:
    """f(middle + way) + sign f(middle - way), of a function f in a table; sign 1 or -1.

    Sum and difference of the same derivative at both places are told by the next derivative, so that what cancels
    does so.
    """
    reach = np.maximum(np.abs(way.value[0]), np.abs(way.value[1]))
    low, high = middle.value[0] - reach, middle.value[1] + reach
    d = [table.on(low, high, order) for order in range(4)]
    two = [(2.0 * one[0], 2.0 * one[1]) for one in d]
    apart = [times(way.value, two[order + 1]) for order in range(3)]  # f^(k)(m + w) - f^(k)(m - w)
    if sign > 0.0:
        value, by_middle, by_way, own, crossed = two[0], two[1], apart[1], two[2], apart[2]
    else:
        value, by_middle, by_way, own, crossed = apart[0], apart[1], two[1], apart[2], two[2]
    slope = _sum(times(_spread(by_middle, 1), middle.slope), times(_spread(by_way, 1), way.slope))
    mixed = _outer(middle.slope, way.slope)
    both = (mixed[0] + mixed[0].swapaxes(1, 2), mixed[1] + mixed[1].swapaxes(1, 2))
    bend = _sum(
        times(_spread(by_middle, 2), middle.bend),
        times(_spread(by_way, 2), way.bend),
        times(_spread(own, 2), _sum(_outer_square(middle.slope), _outer_square(way.slope))),
        times(_spread(crossed, 2), both),
    )
    return Bounded(value, slope, bend)
