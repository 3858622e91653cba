"""Two vehicles on one map in braille: their homes, tracks and headings, north up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from darko_gcs.tui.render.canvas import BrailleCanvas, StyledLine
from darko_gcs.tui.render.map_background import is_drawable
from darko_gcs.tui.render.map_drawing import ARROWS_FROM_NORTH, NorthEast, fitting_view


class MapFlight(NamedTuple):
    """Content that a map shows of one flight."""

    letter: str
    style: str
    track: Sequence[NorthEast]  # [m]
    vehicle: tuple[float, float, float] | None  # north, east [m], heading [rad]


def draw_pair_map(flights: Sequence[MapFlight], width: int, height: int) -> list[StyledLine]:
    """The rows of the map; everything fits. Each vehicle is an arrow behind its letter."""
    drawn = [flight._replace(track=[place for place in flight.track if is_drawable(place)]) for flight in flights]
    places = [place for flight in drawn for place in flight.track]
    places += [flight.vehicle[:2] for flight in drawn if flight.vehicle is not None and is_drawable(flight.vehicle)]
    scale, middle = fitting_view(places, width, height)
    canvas = BrailleCanvas(width, height)

    def at(place: NorthEast) -> tuple[float, float]:
        return width + (place[1] - middle[1]) * 4.0 / scale, 2 * height - (place[0] - middle[0]) * 4.0 / scale

    for flight in drawn:
        for a, b in pairwise(flight.track):
            canvas.line(at(a), at(b), flight.style)
    for flight in drawn:
        if flight.vehicle is not None and is_drawable(flight.vehicle):
            x, y = at(flight.vehicle[:2])
            arrow = ARROWS_FROM_NORTH[round(flight.vehicle[2] / (math.pi / 4)) % 8]
            canvas.put(math.floor(x / 2), math.floor(y / 4), arrow + flight.letter, flight.style)
    canvas.put(0, canvas.height - 1, f"{scale:.3g} m a row", "dim")
    canvas.put(canvas.width - 3, 0, "N↑", "dim")
    return canvas.lines()
