"""The track at any record of a log: in the vehicle's local frame, or from its first place on the globe."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from darko_gcs.state.reduce import MAX_TRACK_POINTS, MIN_TRACK_STEP, thinned
from protocol import units
from protocol.frames import Geodetic, LocalFrame

Rows = NDArray[np.int64]  # indices of records, ascending
Columns = Mapping[str, NDArray[np.generic]]
Point = tuple[float, float]  # north, east [m]


class RecordedTrack:
    """Track of the vehicle in a recording.

    After a restart a vehicle tells its places on the globe until, or unless, it tells a position in its local frame.

    Args:
        local_rows: Records of LOCAL_POSITION_NED.
        local: Their fields.
        fix_rows: Records of GLOBAL_POSITION_INT that tell a place.
        fixes: Their fields.
        restarts: Records at which the vehicle is known to have restarted.
    """

    def __init__(self, local_rows: Rows, local: Columns, fix_rows: Rows, fixes: Columns, restarts: Rows) -> None:
        self._local_rows = local_rows
        self._starts: dict[int, Geodetic] = {}  # by record
        positions = list(zip(local["x"].tolist(), local["y"].tolist(), strict=True))
        places = list(zip(*(fixes[name].tolist() for name in ("lat", "lon", "alt")), strict=True))
        found: list[tuple[int, Point]] = []
        longest = 0
        for begin, end in pairwise((0, *restarts.tolist(), math.inf)):
            local_begin, local_end = np.searchsorted(local_rows, (begin, end)).tolist()
            silent_until = local_rows[local_begin] if local_begin < local_end else end
            fix_begin, fix_end = np.searchsorted(fix_rows, (begin, silent_until)).tolist()
            before = len(found)
            found += self._on_globe(fix_rows[fix_begin:fix_end].tolist(), places[fix_begin:fix_end])
            found += _apart(local_rows[local_begin:local_end].tolist(), positions[local_begin:local_end])
            longest = max(longest, len(found) - before)
        self._rows = np.array([row for row, _ in found], dtype=np.int64)
        self._points = np.array([point for _, point in found]).reshape(-1, 2)
        self._start_rows = np.array(list(self._starts), dtype=np.int64)
        self._thinnings = _thinnings(longest)

    def start(self, first: int, played: int) -> Geodetic | None:
        """The first place on the globe since a record, if nothing else is told of the position; else None."""
        at = int(np.searchsorted(self._start_rows, first))
        if at == len(self._start_rows) or self._start_rows[at] >= played or self._local_row(first) < played:
            return None
        return self._starts[int(self._start_rows[at])]

    def points(self, first: int, played: int) -> tuple[Point, ...]:
        """The track from a record on after so many records, north and east [m]."""
        local = self._local_row(first)
        begin, end = np.searchsorted(self._rows, (local if local < played else first, played)).tolist()
        return tuple(map(tuple, self._points[begin + _kept(self._thinnings, end - begin)].tolist()))

    def _local_row(self, first: int) -> float:
        """The first record of a local position from a record on."""
        at = int(np.searchsorted(self._local_rows, first))
        return self._local_rows[at] if at < len(self._local_rows) else math.inf

    def _on_globe(self, rows: list[int], places: list[tuple[int, int, int]]) -> Iterator[tuple[int, Point]]:
        if not rows:
            return iter(())
        geodetic = [Geodetic(units.from_e7(n), units.from_e7(e), units.from_millimetres(up)) for n, e, up in places]
        self._starts[rows[0]] = geodetic[0]
        frame = LocalFrame(geodetic[0])
        return _apart(rows, [frame.to_ned(place)[:2] for place in geodetic])


def _apart(rows: list[int], points: list[Point]) -> Iterator[tuple[int, Point]]:
    """The points that are far enough from the one before."""
    last = None
    for row, point in zip(rows, points, strict=True):
        if last is None or math.dist(last, point) >= MIN_TRACK_STEP:
            last = point
            yield row, point


def _thinnings(points: int) -> list[tuple[int, Rows]]:
    """Thinnings of a growing track: the number of points before each, and the indices of those left."""
    thinnings: list[tuple[int, Rows]] = []
    track, before = tuple(range(min(points, MAX_TRACK_POINTS))), MAX_TRACK_POINTS
    while before < points:
        left = thinned(track)
        thinnings.append((before, np.array(left)))
        after = before + MAX_TRACK_POINTS - len(left)
        track, before = (*left, *range(before, after)), after
    return thinnings


def _kept(thinnings: list[tuple[int, Rows]], points: int) -> Rows:
    """Indices of the points that are left of so many in a track."""
    before, left = next(
        ((before, left) for before, left in reversed(thinnings) if before < points), (0, np.zeros(0, dtype=np.int64))
    )
    return np.concatenate((left, np.arange(before, points)))
