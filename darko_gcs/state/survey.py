"""A survey: parallel lines over a polygon, flown to and fro as a lawn is mown."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from darko_gcs.state.fence_shapes import Place

MAX_WAYPOINTS = 200  # of one survey


def rectangle(middle: Place, length: float, width: float, heading: float) -> tuple[Place, ...]:
    """Corners of a rectangle.

    Args:
        middle: North and east of its middle [m].
        length: Along the heading [m].
        width: Across it [m].
        heading: Clockwise from north [rad].
    """
    signs = ((1, 1), (1, -1), (-1, -1), (-1, 1))
    return tuple(_turned((a * length / 2.0, b * width / 2.0), heading, middle) for a, b in signs)


def survey_lines(corners: Sequence[Place], spacing: float, heading: float, inset: float = 0.0) -> tuple[Place, ...]:
    """Ends of the lines over a polygon, in the order in which they are flown: north and east [m].

    Args:
        corners: Of the polygon, north and east [m]; of one with a bay a line goes on across the bay.
        spacing: Between lines, and twice that of the outer ones from the edge [m].
        heading: Of the first line, clockwise from north [rad].
        inset: Of the ends from the edge [m].

    Raises:
        ValueError: There would be no line, or too many waypoints; the message says so.
    """
    turned = [_turned_back(corner, heading) for corner in corners]
    sides = [side for _, side in turned]
    count = max(1, round((max(sides) - min(sides)) / spacing))
    if 2 * count > MAX_WAYPOINTS:
        raise ValueError(f"Spacing: {2 * count:,} waypoints, no more than {MAX_WAYPOINTS} are put in at once")
    first = (max(sides) + min(sides) - (count - 1) * spacing) / 2.0
    lines = [_line(turned, first + number * spacing, inset) for number in range(count)]
    flown = [ends if number % 2 == 0 else ends[::-1] for number, ends in enumerate(filter(None, lines))]
    if not flown:
        raise ValueError("Spacing: no line fits into the area")
    return tuple(_turned(place, heading) for ends in flown for place in ends)


def _line(corners: Sequence[Place], side: float, inset: float) -> tuple[Place, Place] | None:
    """Both ends of the line at a distance to the side; None where it is too short."""
    met = list(_crossings(corners, side))
    if not met or max(met) - min(met) <= 2.0 * inset:
        return None
    return (min(met) + inset, side), (max(met) - inset, side)


def _crossings(corners: Sequence[Place], side: float) -> Iterator[float]:
    """Distances along the line at which it meets the edges of the polygon [m]."""
    for (along, a), (end, b) in pairwise((*corners, corners[0])):
        if min(a, b) <= side <= max(a, b) and a != b:
            yield along + (end - along) * (side - a) / (b - a)


def _turned(place: Place, heading: float, middle: Place = (0.0, 0.0)) -> Place:
    """North and east of a place that is told along the heading and across it, to the right."""
    along, side = place
    cosine, sine = math.cos(heading), math.sin(heading)
    return middle[0] + along * cosine - side * sine, middle[1] + along * sine + side * cosine


def _turned_back(place: Place, heading: float) -> Place:
    return _turned(place, -heading)
