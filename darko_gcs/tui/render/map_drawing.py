"""Maps in braille: home, fence, rally points, legs, circles, tracks, vehicles; north up, one scale for both axes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from darko_gcs.tui.render.canvas import BrailleCanvas, StyledLine

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


MapLabel = tuple[str, NorthEast, str]  # text, its first character at a place, and style
MapShape = tuple[str, Sequence[NorthEast], str]  # name, line (or one place), and style
MIN_EXTENT = 6.0  # of the whole map [m]
LONE_EXTENT = 60.0  # of a map of one place: what may soon be about it [m]
LONE = 0.5  # within which several places count as one [m]
PREDICTED_SPACING = 3.0  # of the dots of the predicted path [dots]
LINE_NAMES = (("planned", "plan"), ("flown", "track"), ("predicted", "accent"))  # what a map may show, and its style
MARGIN = 1.25
ARROWS_FROM_NORTH = "↑↗→↘↓↙←↖"  # clockwise, 45 deg apart
WAYPOINT_STYLES = {"done": "good", "current": "now", "todo": "plan"}
LINE_STYLES = {"current": "now", "fence": "fence", "keep-out": "mark"}
KILOMETRE = 1000.0  # [m]
BESIDE = 2  # cells right of its place, where a number may stand, too
CIRCLE_SPACING = 1.5  # of the dots on a circle [dots]
MAX_CIRCLE_DOTS = 2000  # on larger circles the spacing grows


class MapView(NamedTuple):
    """Part of the world that a map shows."""

    scale: float  # [m] per cell height
    middle: NorthEast


class MapWindow(NamedTuple):
    """Size of a map, and the part of the world that it shall show."""

    width: int  # cells; a cell is twice as high as wide
    height: int  # cells
    scale: float | None = None  # [m] per cell height; None fits everything
    middle: NorthEast | None = None  # None: that of everything


@dataclass(frozen=True, kw_only=True)
class MapContent:
    """Content of a map.

    Attributes:
        home: Home.
        track: Past positions of the vehicle.
        waypoints: Number, north, east and state ("todo", "current", "done") of each.
        vehicle: North, east [m] and heading [rad].
        name: Of the vehicle, beside it.
        target: Position set-point of the vehicle.
        circles: North, east, radius [m] and state of each, of the mission or of the fence.
        predicted: Positions of the vehicle in the next seconds, from the present one.
        wind: Velocity of the air, north and east [m/s].
        overlay: The pilot's own shapes; they do not count for the scale.
        areas: Corners and state ("fence", "keep-out") of each polygon of the fence.
        rally: Rally points, where the vehicle may return to instead of home.
        labels: Texts at places, such as the names of a flight plan's waypoints.
        others: Id, north, east [m] and heading [rad] of the other vehicles.
    """

    home: NorthEast | None = None
    track: Sequence[NorthEast] = ()
    waypoints: Sequence[tuple[int, float, float, str]] = ()
    vehicle: tuple[float, float, float] | None = None
    name: str = ""
    target: NorthEast | None = None
    circles: Sequence[tuple[float, float, float, str]] = ()
    predicted: Sequence[NorthEast] = ()
    wind: NorthEast | None = None
    overlay: Sequence[MapShape] = ()
    areas: Sequence[tuple[Sequence[NorthEast], str]] = ()
    rally: Sequence[NorthEast] = ()
    labels: Sequence[MapLabel] = ()
    others: Sequence[tuple[int, float, float, float]] = ()

    @property
    def places(self) -> list[NorthEast]:
        """Positions of all content but the track and the target [m]."""
        places = [(n, e) for _, n, e, _ in self.waypoints]
        places += [(n + side * r, e + side * r) for n, e, r, _ in self.circles for side in (-1.0, 1.0)]
        places += [*self.rally, *(corner for corners, _ in self.areas for corner in corners)]
        places += [place for _, place, _ in self.labels] + [(n, e) for _, n, e, _ in self.others]
        return places + [place[:2] for place in (self.home, self.vehicle) if place is not None]


def draw_map(
    window: MapWindow, content: MapContent, background: MapBackground | None = None
) -> tuple[list[StyledLine], MapView]:
    """The rows of the map, and what part of the world it shows.

    Args:
        window: Its size and part of the world.
        content: What lies on it.
        background: Of the drawing before, if this is one of many of the same map.
    """
    background = background or MapBackground()
    background.follow(content.track)
    width, height, scale, wanted_middle = window
    places = [*background.ends, *content.places, *([] if content.target is None else [content.target])]
    places = [place for place in places if is_drawable(place)] or [(0.0, 0.0)]
    scale = scale or _fit(places, width, height)
    middle = wanted_middle or _in_whole_cells(_middle(places), scale)
    dots = 4.0 / scale  # per metre, the same in both directions

    def at(point: NorthEast) -> Dot:
        return width + (point[1] - middle[1]) * dots, 2 * height - (point[0] - middle[0]) * dots

    def draw_shapes(canvas: BrailleCanvas) -> None:
        _draw_overlay(canvas, at, content.overlay)
        for corners, state in content.areas:
            for a, b in pairwise((*corners, corners[0])):
                canvas.line(at(a), at(b), LINE_STYLES.get(state, "plan"))
        for (_, north, east, _), (_, *end, state) in pairwise(content.waypoints):
            canvas.line(at((north, east)), at((end[0], end[1])), LINE_STYLES.get(state, "plan"))
        for north, east, radius, state in content.circles:
            _circle(canvas, at((north, east)), radius * dots, LINE_STYLES.get(state, "plan"))

    shapes = (content.overlay, content.areas, content.waypoints, content.circles)
    key = (width, height, scale, middle, *shapes)
    canvas = background.canvas((width, height), key, draw_shapes, at)
    _dotted(canvas, [at(place) for place in content.predicted if is_drawable(place)], "accent")
    _legend(canvas, content, _scale_bar(canvas, scale))
    _wind(canvas, content.wind)
    _texts(canvas, at, content)
    return canvas.lines(), MapView(scale, middle)


def fitting_view(places: Sequence[NorthEast], width: int, height: int) -> tuple[float, NorthEast]:
    """Scale [m per cell height] and middle of a map that shows all places."""
    drawable = [place for place in places if is_drawable(place)] or [(0.0, 0.0)]
    return _wanted_scale(drawable, width, height), _middle(drawable)


def place_at(cell: tuple[int, int], width: int, height: int, scale: float, middle: NorthEast) -> NorthEast:
    """North and east [m] of the middle of a cell (column, row) of a map."""
    column, row = cell
    north = middle[0] + (height / 2 - row - 0.5) * scale
    return north, middle[1] + (column + 0.5 - width / 2) * scale / 2


def _labels(
    canvas: BrailleCanvas,
    at: Callable[[NorthEast], Dot],
    labels: Sequence[MapLabel],
    number_styles: Mapping[str, str] | None = None,
) -> None:
    """The last ones matter most: one without room shows its number or its first character, or nothing."""
    for text, place, style in reversed(labels):
        x, y = at(place)
        if not is_drawable((x, y)):
            continue
        column, row = math.floor(x / 2), math.floor(y / 4)
        number = text[: len(text) - len(text.lstrip("0123456789"))]
        shifts = (0, BESIDE) if number else (0,)  # a mark stands where its place is
        fitting = ((column + k, part) for part in (text, number or text[:1]) for k in shifts)
        begin, shown = next(((c, part) for c, part in fitting if canvas.has_room(c, row, part)), (column, ""))
        canvas.put(begin, row, shown, style)
        canvas.put(begin, row, number[: len(shown)], (number_styles or {}).get(number, style))


def _draw_overlay(canvas: BrailleCanvas, at: Callable[[NorthEast], Dot], overlay: Sequence[MapShape]) -> None:
    for _, line, style in overlay:
        for a, b in pairwise(line):
            canvas.line(at(a), at(b), style)


def _overlay_labels(overlay: Sequence[MapShape]) -> list[MapLabel]:
    """Name of each shape at its first place; a place without a name is a dot."""
    return [(name if len(line) > 1 else f"•{name}", line[0], style) for name, line, style in overlay if line]


def _dotted(canvas: BrailleCanvas, path: Sequence[Dot], style: str) -> None:
    """Dots along a path, evenly spaced: a prediction is no line."""
    left = PREDICTED_SPACING
    for (x, y), (end_x, end_y) in pairwise(path):
        length = math.hypot(end_x - x, end_y - y)
        if not length < MAX_CIRCLE_DOTS:  # zoomed in far, or nonsense
            return
        while left <= length:
            share = left / length
            canvas.plot(x + share * (end_x - x), y + share * (end_y - y), style)
            left += PREDICTED_SPACING
        left -= length


def _legend(canvas: BrailleCanvas, content: MapContent, taken: int) -> None:
    """Names of the lines, right of the scale bar, as many as there is room for.

    Args:
        canvas: The map.
        content: What is on it.
        taken: Cells of the scale bar.
    """
    holds = {"planned": len(content.waypoints) > 1, "flown": len(content.track) > 1, "predicted": content.predicted}
    shown = [(name, style) for name, style in LINE_NAMES if holds[name]]
    while shown and canvas.width - sum(len(name) + 1 for name, _ in shown) <= taken:
        shown.pop()
    column = canvas.width - sum(len(name) + 1 for name, _ in shown) + 1
    for name, style in shown:
        canvas.put(column - 1, canvas.height - 1, f" {name}", style)  # its blank covers what lies there
        column += len(name) + 1


def _wind(canvas: BrailleCanvas, wind: NorthEast | None) -> None:
    """Direction and speed of the air, in the upper left corner."""
    if wind is not None and is_drawable(wind):
        text = f"{_arrow(math.atan2(wind[1], wind[0]))} wind {math.hypot(*wind):.1f} m/s"
        if len(text) < canvas.width - 4:
            canvas.put(0, 0, text, "label")


def _circle(canvas: BrailleCanvas, centre: Dot, radius: float, style: str) -> None:
    if not (is_drawable(centre) and 0.0 < radius < MAX_COORDINATE):
        return
    count = min(MAX_CIRCLE_DOTS, max(8, math.ceil(2.0 * math.pi * radius / CIRCLE_SPACING)))
    for k in range(count):
        angle = 2.0 * math.pi * k / count
        canvas.plot(centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle), style)


def _texts(canvas: BrailleCanvas, at: Callable[[NorthEast], Dot], content: MapContent) -> None:
    """Symbols and labels, what matters most first: the vehicle lies on everything, others only where there is room."""
    if content.vehicle is not None and is_drawable(dot := at(content.vehicle[:2])):
        arrow = _arrow(content.vehicle[2]) + content.name
        canvas.put(math.floor(dot[0] / 2), math.floor(dot[1] / 4), arrow, "accent")
    styles = {str(number): WAYPOINT_STYLES.get(state, "") for number, _, _, state in content.waypoints}
    labelled = {text.rstrip("◆").split(" ")[0] for text, _, _ in content.labels}
    numbers = [(str(n), (north, east), styles[str(n)]) for n, north, east, _ in content.waypoints]
    labels: list[MapLabel] = [
        *_overlay_labels(content.overlay),
        *(number for number in numbers if number[0] not in labelled),
        *content.labels,
        *(("R", place, "fence") for place in content.rally),
        *([] if content.home is None else [("H", content.home, "accent")]),
        *([] if content.target is None else [("+", content.target, "now")]),
        *((f"{_arrow(heading)}{system}", (n, e), "label") for system, n, e, heading in content.others),
    ]
    _labels(canvas, at, labels, styles)


def _arrow(heading: float) -> str:
    """An arrow that points the way of a heading [rad]; nothing for one that is nonsense."""
    return ARROWS_FROM_NORTH[round(heading / (math.pi / 4)) % 8] if is_drawable((heading,)) else ""


def _fit(places: Sequence[NorthEast], width: int, height: int) -> float:
    return _round_up(_wanted_scale(places, width, height))


def _wanted_scale(places: Sequence[NorthEast], width: int, height: int) -> float:
    north = max(p[0] for p in places) - min(p[0] for p in places)
    east = max(p[1] for p in places) - min(p[1] for p in places)
    least = LONE_EXTENT if max(north, east) < LONE else MIN_EXTENT
    return max(MARGIN * north / height, MARGIN * east / (width / 2), least / height)


def _round_up(value: float) -> float:
    """The next larger 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value * 0.999)


def _middle(places: Sequence[NorthEast]) -> NorthEast:
    north, east = [p[0] for p in places], [p[1] for p in places]
    return (min(north) + max(north)) / 2, (min(east) + max(east)) / 2


def _in_whole_cells(middle: NorthEast, scale: float) -> NorthEast:
    """The middle of a map that grows moves by whole cells, or all of it would change every time."""
    return round(middle[0] / scale) * scale, round(middle[1] / scale) * scale


def _scale_bar(canvas: BrailleCanvas, scale: float) -> int:
    """Draw the scale bar; how many cells it takes."""
    length = _round_up(scale * 1.5)
    cells = max(1, round(2 * length / scale))
    text = f"{length / KILOMETRE:g} km" if length >= KILOMETRE else f"{length:g} m"
    bar = f"├{'─' * max(0, cells - 2)}┤ {text}"
    bar = bar if len(bar) <= canvas.width else text if len(text) <= canvas.width else ""
    canvas.put(0, canvas.height - 1, bar, "dim")
    canvas.put(canvas.width - 3, 0, "N↑", "dim")
    return len(bar)


class MapFlight(NamedTuple):
    """Content that a map shows of one flight."""

    letter: str
    style: str
    track: Sequence[NorthEast]  # [m]
    vehicle: tuple[float, float, float] | None  # north, east [m], heading [rad]


def draw_pair_map(
    flights: Sequence[MapFlight], width: int, height: int, overlay: Sequence[MapShape] = ()
) -> list[StyledLine]:
    """The rows of the map; everything but the overlay fits. Each vehicle is an arrow behind its letter."""
    drawn = [flight._replace(track=[place for place in flight.track if is_drawable(place)]) for flight in flights]
    places = [place for flight in drawn for place in flight.track]
    places += [flight.vehicle[:2] for flight in drawn if flight.vehicle is not None and is_drawable(flight.vehicle)]
    scale, middle = fitting_view(places, width, height)
    canvas = BrailleCanvas(width, height)

    def at(place: NorthEast) -> tuple[float, float]:
        return width + (place[1] - middle[1]) * 4.0 / scale, 2 * height - (place[0] - middle[0]) * 4.0 / scale

    _draw_overlay(canvas, at, overlay)
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
    _labels(canvas, at, _overlay_labels(overlay))
    return canvas.lines()
