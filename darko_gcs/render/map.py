"""A map in braille: home, fence, rally points, legs, circles, track and vehicle, north up, one scale for both axes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

from darko_gcs.render.canvas import Braille, Line

__all__ = ["draw_map"]

Point = tuple[float, float]  # north, east [m]
SMALLEST = 6.0  # metres across, however near everything is
MARGIN = 1.25
FARTHEST = 1e7  # places beyond are nonsense, and not drawn [m]
ARROWS = "↑↗→↘↓↙←↖"
STATES = {"done": "good", "current": "warn", "todo": "plan"}
LEGS = {"current": "warn", "fence": "fence", "keep-out": "mark"}
SPACING = 1.5  # of the dots on a circle [dots]
MOST_DOTS = 2000  # on a circle: larger ones are dotted more widely


def draw_map(
    *,
    width: int,
    height: int,
    scale: float | None,
    centre: Point | None,
    home: Point | None,
    track: Sequence[Point],
    waypoints: Sequence[tuple[int, float, float, str]],
    vehicle: tuple[float, float, float] | None,
    target: Point | None,
    circles: Sequence[tuple[float, float, float, str]] = (),
    course: Point | None = None,
    areas: Sequence[tuple[Sequence[Point], str]] = (),
    rally: Sequence[Point] = (),
) -> tuple[list[Line], float]:
    """The map's lines and its scale [m per cell height].

    Args:
        width: Cells; a cell is taken to be twice as high as wide.
        height: Cells.
        scale: Metres per cell height; None fits everything.
        centre: In the middle; None: the middle of everything.
        home: Where home is.
        track: Where the vehicle has been.
        waypoints: Number, north, east and state ("todo", "current", "done") of each.
        vehicle: North, east [m] and heading [rad].
        target: Where the vehicle is told to be.
        circles: North, east, radius [m] and state of each, of the mission or of the fence.
        course: Where the vehicle will be soon; a line leads there.
        areas: Corners and state ("fence", "keep-out") of each polygon of the fence.
        rally: Where the vehicle may return to instead of home.
    """
    places = [*track, *((n, e) for _, n, e, _ in waypoints)]
    places += [(n + side * r, e + side * r) for n, e, r, _ in circles for side in (-1.0, 1.0)]
    places += [*rally, *(corner for corners, _ in areas for corner in corners)]
    places += [place for place in (home, target, None if vehicle is None else vehicle[:2]) if place is not None]
    places = [place for place in places if _is_real(place)] or [(0.0, 0.0)]
    scale = scale or _fit(places, width, height)
    middle = centre or _middle(places)
    canvas = Braille(width, height)
    dots = 4.0 / scale  # per metre, the same in both directions

    def at(point: Point) -> Point:
        return width + (point[1] - middle[1]) * dots, 2 * height - (point[0] - middle[0]) * dots

    for corners, state in areas:
        for a, b in pairwise((*corners, corners[0])):
            canvas.line(*at(a), *at(b), LEGS.get(state, "plan"))
    for (_, north, east, _), (_, *end, state) in pairwise(waypoints):
        canvas.line(*at((north, east)), *at((end[0], end[1])), LEGS.get(state, "plan"))
    for north, east, radius, state in circles:
        _circle(canvas, at((north, east)), radius * dots, LEGS.get(state, "plan"))
    for a, b in pairwise(track):
        canvas.line(*at(a), *at(b), "track")
    if course is not None and vehicle is not None:
        canvas.line(*at(vehicle[:2]), *at(course), "bad")
    _symbols(canvas, at, home, rally, waypoints, vehicle, target)
    _scale_bar(canvas, scale)
    return canvas.lines(), scale


def _circle(canvas: Braille, centre: Point, radius: float, style: str) -> None:
    if not (_is_real(centre) and 0.0 < radius < FARTHEST):
        return
    count = min(MOST_DOTS, max(8, math.ceil(2.0 * math.pi * radius / SPACING)))
    for k in range(count):
        angle = 2.0 * math.pi * k / count
        canvas.plot(centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle), style)


def _symbols(
    canvas: Braille,
    at: Callable[[Point], Point],
    home: Point | None,
    rally: Sequence[Point],
    waypoints: Sequence[tuple[int, float, float, str]],
    vehicle: tuple[float, float, float] | None,
    target: Point | None,
) -> None:
    def put(point: Point, text: str, style: str) -> None:
        x, y = at(point)
        if _is_real((x, y)):
            canvas.put(math.floor(x / 2), math.floor(y / 4), text, style)

    for point in rally:
        put(point, "R", "fence")
    if home is not None:
        put(home, "H", "accent")
    for number, north, east, state in waypoints:
        put((north, east), str(number), STATES.get(state, ""))
    if target is not None:
        put(target, "+", "warn")
    if vehicle is not None and _is_real((vehicle[2], 0.0)):
        put(vehicle[:2], ARROWS[round(vehicle[2] / (math.pi / 4)) % 8], "bad")


def _is_real(point: Point) -> bool:
    return all(abs(part) < FARTHEST for part in point)  # false for NaN too


def _fit(places: Sequence[Point], width: int, height: int) -> float:
    north = max(p[0] for p in places) - min(p[0] for p in places)
    east = max(p[1] for p in places) - min(p[1] for p in places)
    wanted = max(MARGIN * north / height, MARGIN * east / (width / 2), SMALLEST / height)
    return _round_up(wanted)


def _round_up(value: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value * 0.999)


def _middle(places: Sequence[Point]) -> Point:
    north, east = [p[0] for p in places], [p[1] for p in places]
    return (min(north) + max(north)) / 2, (min(east) + max(east)) / 2


def _scale_bar(canvas: Braille, scale: float) -> None:
    length = _round_up(scale * 1.5)
    cells = max(1, round(2 * length / scale))
    canvas.put(0, canvas.height - 1, f"├{'─' * max(0, cells - 2)}┤ {length:g} m", "dim")
    canvas.put(canvas.width - 3, 0, "N↑", "dim")
