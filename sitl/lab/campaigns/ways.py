"""Distances from a way through points: ``from_way(north, west, up, ...)`` and ``from_level_way(north, west, ...)``."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from sitl import Array

WAY_FUNCTIONS = {"from_way": 3, "from_level_way": 2}  # series of measures, with so many numbers for each point


def distance_from_way(positions: Array, points: Sequence[Sequence[float]]) -> Array:
    """Distance of places from a way, (n,) [m].

    Args:
        positions: World NWU or level NW, (n, 3) or (n, 2) [m].
        points: Of the way, in turn, likewise.
    """
    ends = [np.array(point) for point in points]
    nearest = np.linalg.norm(positions - ends[0], axis=1)
    for a, b in itertools.pairwise(ends):
        share = np.clip((positions - a) @ (b - a) / max((b - a) @ (b - a), 1e-9), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(positions - a - share[:, None] * (b - a), axis=1))
    return np.asarray(nearest)
