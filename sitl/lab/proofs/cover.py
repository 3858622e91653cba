"""Test on boxes of attitudes that the matrix of V's decrease is positive.

See :mod:`sitl.lab.proofs.region` for what is proved, and
:mod:`sitl.lab.proofs.closed_loop` for the matrices.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl import Array
from sitl.compiled import entry, subroutine
from sitl.lab.proofs.closed_loop import (
    AttitudeBoxes,
    Interval,
    Lift,
    Terms,
    elevon_effect,
    gyro_matrices,
    most,
    row_matrix,
    tilt_matrices,
)
from sitl.lab.proofs.proof import MARGIN, Proof, greatest_deflection
from sitl.lab.proofs.stalled import Main
from sitl.lab.proofs.surfaces import normal_motion

MAX_BOXES = 2_000  # at one level of splitting; a set that needs more counts as not proved
FIRST_BOXES = 8  # boxes per axis to begin with
DEPTH = 12  # how often a box is split at most

Booleans = npt.NDArray[np.bool_]


def falls_within(proof: Proof, level: float, boxes: int = MAX_BOXES) -> bool:
    """Whether V' < 0 is proved on {V <= level} without the hover itself; more boxes prove more."""
    made = proof.lift(level)
    if made is None or np.linalg.eigvalsh(made.base)[0] <= MARGIN:
        return False
    cover = Cover(proof, made, level, min(proof.a.delta_max, greatest_deflection(proof.gains, level)))
    widest = np.sqrt(level * np.diag(np.linalg.inv(proof.S_f)))
    centre, half = attitude_boxes(widest, FIRST_BOXES, is_mirrored=proof.is_mirrored())
    for _ in range(DEPTH):
        inside = cover.budget(centre, half) >= 0.0
        centre, half = centre[inside], half[inside]
        if centre.shape[0] > boxes:
            return False
        if centre.shape[0] == 0:
            return True
        left = ~cover.holds(centre, half, MARGIN)
        if left.any() and not cover.holds(centre[left], np.zeros_like(half[left]), 0.0).all():
            return False  # not even at the middle: no splitting would help
        centre, half = split(centre[left], half[left], cover.effect)
    return False


def attitude_boxes(widest: Array, per_axis: int, *, is_mirrored: bool) -> tuple[Array, Array]:
    """Equal boxes about the attitudes of a set: centres and halves of their widths, (n, 3) each.

    Args:
        widest: Half the width of the set along each axis, (3,).
        per_axis: How many.
        is_mirrored: Whether one half is enough, the other being its mirror image.
    """
    middles = (2.0 * np.arange(per_axis) + 1.0) / per_axis - 1.0
    centre = widest * np.stack(np.meshgrid(middles, middles, middles), axis=-1).reshape(-1, 3)
    if is_mirrored:
        centre = centre[centre[:, 0] > 0.0]
    return centre, np.broadcast_to(widest / per_axis, centre.shape)


class Bend(NamedTuple):
    """A share of M on each box, and what one of it takes off the lifted matrix."""

    share: Interval  # per box
    takes: Array  # (N, N)
    width: Array  # (N, N): not less than ``takes`` and its negative

    def off(self, middle: Array) -> Array:
        """Each box's matrix less the least favourable share."""
        low, high = self.share.low[:, None, None], self.share.high[:, None, None]
        return np.asarray(middle - 0.5 * (low + high) * self.takes - 0.5 * (high - low) * self.width)


class Cover:
    """The test on boxes of attitudes, at one level."""

    def __init__(self, proof: Proof, made: Lift, level: float, deflection: float) -> None:
        self.proof, self.lift, self.level = proof, made, level
        self._known: dict[bytes, tuple[Array, Array]] = {}
        self.stalled = proof.stalled(level)
        # Absolute values in the metric of what there is to take off cost less of it.
        self.metric = None if self.stalled is None else np.linalg.cholesky(made.base)
        n = len(proof.L)
        self.tilt = [self._taken(M) for M in tilt_matrices(proof.a, proof.gains)]
        self.turns = gyro_matrices(proof.a, n)
        self.gyro = np.stack([made.of(M) for M in gyro_matrices(proof.a, n)])
        self.effect = np.array([np.linalg.norm(width, 2) for _, width in self.tilt])
        self.effectiveness = proof.effectiveness(level)
        self.deflection = deflection

    def budget(self, centre: Array, half: Array) -> Array:
        """Upper bound of the level left for the rest of the state by a box's attitudes; negative outside, (n,)."""
        S_f = self.proof.S_f
        least = np.einsum("ni,ij,nj->n", centre, S_f, centre) - 2.0 * np.abs(centre @ S_f * half).sum(1)
        return np.asarray(self.level - np.maximum(least, 0.0))

    def holds(self, centre: Array, half: Array, margin: float) -> Booleans:
        """Whether all eigenvalues exceed a margin everywhere on each box; nowhere beyond eta = 0, (n,)."""
        proof, budget = self.proof, np.maximum(self.budget(centre, half), 0.0)
        at = AttitudeBoxes(centre - half, centre + half)
        middle = np.broadcast_to(self.lift.base, (len(centre), *self.lift.base.shape))
        for share, (takes, width) in zip((at.d1, at.e2, at.d3), self.tilt, strict=True):
            middle = Bend(share, takes, width).off(middle)
        for bend in self._bends(proof.remainder(at)):
            middle = bend.off(middle)
        rates, rate_half = centre @ proof.mean[3:].T, half @ np.abs(proof.mean[3:]).T
        rate_half = rate_half + np.sqrt(budget[:, None] * np.diag(proof.spread)[3:])
        if self.stalled is not None:
            motion = self._motion(centre, half, budget)
            turns = zip(rates.T - rate_half.T, rates.T + rate_half.T, self.turns, strict=True)
            terms = [*self.stalled.terms(at, *motion), *((Interval(low, high), M) for low, high, M in turns)]
            for bend in self._bends(terms):
                middle = bend.off(middle)
            along = self._normal(centre, half, budget)
            held = self._holds_stalled(middle, self.stalled.main_terms(*motion, along, at), margin)
        else:
            low, high = (np.ascontiguousarray((rates + sign * rate_half).T) for sign in (-1.0, 1.0))
            held = np.ones(len(centre), dtype=np.bool_)
            for wind in self._winds(at, self._airspeed(centre, half, budget)):
                held &= _exceed(middle + wind, low, high, self.gyro[:, None], margin)
        return np.asarray(at.upright & held)

    def _holds_stalled(self, middle: Array, terms: list[Main], margin: float) -> Booleans:
        """Whether they do at the corners of what the wing that stalls does mainly, (n,)."""
        parts = []
        for main in terms:
            takes = np.broadcast_to(self._taken(main.M)[0], middle.shape)
            for bend in self._bends(main.turned):
                takes = takes + 0.5 * (bend.share.low + bend.share.high)[:, None, None] * bend.takes
                loose = 0.5 * (bend.share.high - bend.share.low) * most(main.share)
                middle = middle - loose[:, None, None] * bend.width
            parts.append((main.share, takes))
        low, high = np.stack([share.low for share, _ in parts]), np.stack([share.high for share, _ in parts])
        return _exceed(np.ascontiguousarray(middle), low, high, np.stack([takes for _, takes in parts]), margin)

    def _motion(self, centre: Array, half: Array, budget: Array) -> tuple[Array, Array]:
        """Bounds of speed [m/s] and rates [rad/s] on each box."""
        bounds = []
        for part in (slice(0, 3), slice(3, 6)):
            mean, spread = self.proof.mean[part], self.proof.spread[part, part]
            far = np.linalg.norm(centre @ mean.T, axis=1) + half @ np.linalg.norm(mean, axis=0)
            bounds.append(far + np.sqrt(budget * np.linalg.eigvalsh(spread)[-1]))
        return bounds[0], bounds[1]

    def _normal(self, centre: Array, half: Array, budget: Array) -> Interval:
        """Speed along the hovering wing's normal on each box [m/s]."""
        row = normal_motion(self.proof.a)
        mean = row @ self.proof.mean
        off = half @ np.abs(mean) + np.sqrt(budget * (row @ self.proof.spread @ row))
        return Interval(centre @ mean - off, centre @ mean + off)

    def _winds(self, at: AttitudeBoxes, h: Array) -> list[Array]:
        """Corners of what the airspeed adds, (boxes, N, N).

        They are h = 0, and h at its bound with the elevons' effectiveness at the corners of what that makes of it.
        """
        proof = self.proof
        nothing = np.zeros((len(h), *self.lift.base.shape))
        either = Interval(np.full(len(h), -2.0 * self.deflection), np.full(len(h), 2.0 * self.deflection))
        terms = proof.air(at, proof.aero.still)
        for G in (proof.aero.both, proof.aero.differ):
            terms += [(value * either, M) for value, M in proof.air(at, G)]
        whole = nothing
        for bend in self._bends(terms):
            whole = bend.off(whole)
        whole = h[:, None, None] * whole
        more = [self._more(at, self.effectiveness * h * h, elevon) for elevon in (0, 1)]
        corners = product(*(((middle, width, 1.0), (middle, width, -1.0)) for middle, width in more))
        whole = whole - sum(width for _, width in more)
        return [nothing[:1], *(whole + s * left + r * right for (left, _, s), (right, _, r) in corners)]

    def _more(self, at: AttitudeBoxes, kappa: Array, elevon: int) -> tuple[Array, Array]:
        """Matrix to subtract for an elevon that is more effective by kappa, and its width, (boxes, N, N)."""
        M, force = elevon_effect(self.proof.a, self.proof.gains, elevon)
        middle = kappa[:, None, None] * self._taken(M)[0]
        width = np.zeros_like(middle)
        for i in range(3):
            share, (takes, most_of_it) = at.axes[2][i], self._taken(row_matrix(3 + i, force))
            middle = middle + (0.5 * kappa * (share.low + share.high))[:, None, None] * takes
            width = width + (0.5 * kappa * (share.high - share.low))[:, None, None] * most_of_it
        return middle, width

    def _airspeed(self, centre: Array, half: Array, budget: Array) -> Array:
        """Upper bound of h = rho S eta / 2 on each box [kg/s]."""
        a = self.proof.a
        weight = np.diag([1.0, 1.0, 1.0, *[math.sqrt(a.mu) * a.c] * 3])
        mean = weight @ self.proof.mean
        most = np.linalg.norm(centre @ mean.T, axis=1) + half @ np.linalg.norm(mean, axis=0)
        most += np.sqrt(budget * np.linalg.eigvalsh(weight @ self.proof.spread @ weight).max())
        return np.asarray(0.5 * a.rho * a.S * most)

    def _bends(self, terms: Terms) -> Iterator[Bend]:
        return (Bend(share, *self._taken(M)) for share, M in terms if M.any() and most(share).any())

    def _taken(self, M: Array) -> tuple[Array, Array]:
        """Lift of M, which is subtracted from the lifted matrix, and its absolute value."""
        key = M.tobytes()
        if key not in self._known:
            takes = self.lift.of(M)
            within = (
                takes if self.metric is None else np.linalg.solve(self.metric, np.linalg.solve(self.metric, takes).T)
            )
            values, vectors = np.linalg.eigh(within)
            width = (vectors * np.abs(values)) @ vectors.T
            self._known[key] = takes, width if self.metric is None else self.metric @ width @ self.metric.T
        return self._known[key]


@entry
def _exceed(middle: Array, low: Array, high: Array, takes: Array, margin: float) -> Booleans:
    """Whether all eigenvalues of symmetric matrices less some parts exceed a margin, at every corner of the shares.

    Args:
        middle: Each box's matrix, (n, N, N).
        low: Least share of each part on each box, (k, n).
        high: Greatest share, (k, n).
        takes: What a part of share 1 takes off, (k, n, N, N), or the same of all boxes, (k, 1, N, N).
        margin: What is to be exceeded.

    Returns:
        One answer per box, (n,): whether there is a Cholesky factor of what is left above the margin.
    """
    found = np.ones(middle.shape[0], dtype=np.bool_)
    size = middle.shape[1]
    left, factor = np.empty((size, size)), np.empty((size, size))
    for box in range(middle.shape[0]):
        for corner in range(1 << low.shape[0]):
            left[:] = middle[box]
            for part in range(low.shape[0]):
                share = high[part, box] if corner >> part & 1 else low[part, box]
                left -= share * takes[part, box % takes.shape[1]]
            for row in range(size):
                left[row, row] -= margin
            if not _is_positive(left, factor):
                found[box] = False
                break
    return found


@subroutine
def _is_positive(matrix: Array, factor: Array) -> bool:
    """Whether a symmetric matrix has a Cholesky factor, which is written as far as it goes."""
    for row in range(matrix.shape[0]):
        for column in range(row + 1):
            left = matrix[row, column]
            for k in range(column):
                left -= factor[row, k] * factor[column, k]
            if row > column:
                factor[row, column] = left / factor[column, column]
            elif left > 0.0:
                factor[row, row] = math.sqrt(left)
            else:
                return False
    return True


def split(centre: Array, half: Array, effect: Array) -> tuple[Array, Array]:
    """Each box halved along the axis that matters most, by the effect of each."""
    axis = (half * effect).argmax(axis=1)
    shift = np.where(np.arange(3) == axis[:, None], 0.5 * half, 0.0)
    half = half - shift
    return np.vstack([centre - shift, centre + shift]), np.vstack([half, half])
