"""Pictures of a flight: its track from the side and from above, drawn by numpy alone."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sitl.model.airframe import Array
from sitl.model.quaternions import Quaternion, rotate
from sitl.model.vectors import Vector

if TYPE_CHECKING:
    from sitl.gym.flight_batch import FlightBatch

SIZE = 240  # of each of the two views [pixels]
LEAST_REACH = 6.0  # shown on either side of the middle [m]
VIEW_MARGIN = 1.25
AIRCRAFT_SIZE = 0.12  # half span, of the view's reach
PAPER, DARK_INK, TRACK, WANTED = (250, 250, 248), (30, 40, 60), (60, 130, 200), (210, 70, 50)
Picture = npt.NDArray[np.uint8]


class FlightPicture:
    """The track of one flight, and pictures of it; left: north and up, right: north and west."""

    def __init__(self) -> None:
        self._track: list[tuple[float, float, float]] = []

    def begin(self, batch: FlightBatch, i: int) -> None:
        """Forget the track of the episode before."""
        self._track = []
        self.follow(batch, i)

    def follow(self, batch: FlightBatch, i: int) -> None:
        """Add where flight ``i`` is."""
        self._track.append(_position(batch, i))

    def draw(self, batch: FlightBatch, i: int) -> Picture:
        """The picture, (SIZE, 2 SIZE, 3)."""
        place = tuple(batch.fleet.goals["place"][i].item())
        track = np.array([*self._track, _position(batch, i)])
        shown = np.vstack([track, place])
        shown = shown[np.isfinite(shown).all(axis=1)]
        middle = 0.5 * (shown.min(axis=0) + shown.max(axis=0))
        reach = max(float(np.abs(shown - middle).max()) * VIEW_MARGIN, LEAST_REACH)
        attitude = Quaternion(*batch.fleet.flights["plant"]["body"]["attitude"][i].item())
        lines = _aircraft(attitude, track[-1], AIRCRAFT_SIZE * reach)
        views = []
        for across in (2, 1):  # up, west
            view = np.full((SIZE, SIZE, 3), PAPER, np.uint8)
            put = _Panel(view, middle[[0, across]], reach)
            put.line(track[:, [0, across]], TRACK)
            put.cross(np.array(place)[[0, across]], WANTED)
            for ends in lines:
                put.line(ends[:, [0, across]], DARK_INK)
            view[:, -1] = DARK_INK
            views.append(view)
        return np.hstack(views)


class _Panel:
    """Draws lines given in metres on a square view."""

    def __init__(self, view: Picture, middle: Array, reach: float) -> None:
        self._view, self._middle, self._scale = view, middle, 0.5 * SIZE / reach

    def line(self, points: Array, colour: tuple[int, int, int]) -> None:
        """A line through points, (n, 2)."""
        at = (points - self._middle) * self._scale
        for a, b in itertools.pairwise(at):
            if np.isfinite((a, b)).all():
                count = min(int(np.abs(b - a).max()), 4 * SIZE) + 2
                self._dots(a + np.linspace(0.0, 1.0, count)[:, None] * (b - a), colour)

    def cross(self, point: Array, colour: tuple[int, int, int]) -> None:
        """A cross at a point, (2,)."""
        size = 6.0 / self._scale
        for way in ((size, 0.0), (0.0, size)):
            self.line(np.array([point - way, point + way]), colour)

    def _dots(self, at: Array, colour: tuple[int, int, int]) -> None:
        across = np.rint(0.5 * SIZE + at[:, 0]).astype(int)
        down = np.rint(0.5 * SIZE - at[:, 1]).astype(int)
        seen = (across >= 0) & (across < SIZE) & (down >= 0) & (down < SIZE)
        self._view[down[seen], across[seen]] = colour


def _position(batch: FlightBatch, i: int) -> tuple[float, float, float]:
    place: Any = batch.fleet.flights["plant"]["body"]["position"][i].item()
    return place  # type: ignore[no-any-return]


def _aircraft(attitude: Quaternion, place: Array, size: float) -> list[Array]:
    """Wing, fuselage and fin of an aircraft as lines, world NWU, each (2, 3)."""
    parts = (
        ((0.0, size, 0.0), (0.0, -size, 0.0)),
        ((0.5 * size, 0.0, 0.0), (-0.5 * size, 0.0, 0.0)),
        ((-0.5 * size, 0.0, 0.0), (-0.5 * size, 0.0, 0.35 * size)),
    )
    return [place + np.array([rotate(attitude, Vector(*end)) for end in ends]) for ends in parts]
