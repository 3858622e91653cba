"""Background of a map behind the vehicle, kept from one drawing to the next."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from darko_gcs.tui.render.canvas import BrailleCanvas

NorthEast = tuple[float, float]  # [m]
Dot = tuple[float, float]  # x, y on the canvas
MAX_COORDINATE = 1e7  # larger ones are nonsense and not drawn [m]


class MapBackground:
    """Shapes and track. Of a track that has grown, only the new end is looked at: it may have many points."""

    def __init__(self) -> None:
        self._track: tuple[NorthEast, ...] = ()
        self.ends: tuple[NorthEast, ...] = ()  # south-west and north-east corner of what the track covers [m]
        self._key: object = None  # what the canvas shows but the track
        self._canvas = BrailleCanvas(0, 0)
        self._drawn = 0  # points of the track that are on the canvas
        self._dot: Dot | None = None  # where the drawn track ends

    def follow(self, track: Sequence[NorthEast]) -> None:
        """Take the present track."""
        before, self._track = self._track, tuple(track)
        if self._track[: len(before)] != before:
            before, self.ends, self._key = (), (), None
        new = [place for place in self._track[len(before) :] if is_drawable(place)]
        if new:
            norths, easts = zip(*new, *self.ends, strict=True)
            self.ends = (min(norths), min(easts)), (max(norths), max(easts))

    def canvas(
        self, size: tuple[int, int], key: object, draw: Callable[[BrailleCanvas], None], at: Callable[[NorthEast], Dot]
    ) -> BrailleCanvas:
        """A canvas with shapes and track, to draw the rest on.

        Args:
            size: Columns and rows.
            key: Equal as long as ``size``, ``draw`` and ``at`` would give the same.
            draw: Draws the shapes.
            at: Where a place lies on the canvas.
        """
        if self._key is None or key != self._key:
            self._key, self._canvas = key, BrailleCanvas(*size)
            self._drawn, self._dot = 0, None
            draw(self._canvas)
        for place in self._track[self._drawn :]:
            self._extend(at(place))
        self._drawn = len(self._track)
        canvas = self._canvas.copy()
        if self._dot is not None:
            canvas.line(self._dot, at(self._track[-1]), "track")
        return canvas

    def _extend(self, dot: Dot) -> None:
        """Draw the track on to a dot that is not beside the one before."""
        last = self._dot
        if last is None:
            self._dot = dot
        elif not (abs(dot[0] - last[0]) < 1.0 and abs(dot[1] - last[1]) < 1.0):
            self._canvas.line(last, dot, "track")
            self._dot = dot


def is_drawable(point: Sequence[float]) -> bool:
    """False for places that are nonsense, and for NaN."""
    return all(abs(part) < MAX_COORDINATE for part in point)
