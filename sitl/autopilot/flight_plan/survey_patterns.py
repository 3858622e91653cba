"""Paths of Paparazzi's navigation modules: a line with U-turns, a flower, surveys of a rectangle and of a polygon.

Each is flown leg by leg and arc by arc; a path whose waypoints move follows them. The modules' own pages:
conf/modules/nav_line, nav_flower, nav_survey_rectangle_rotorcraft, nav_survey_poly_osam of Paparazzi.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from protocol.flight_plans.flight_plan import EnuPoint
from sitl.autopilot.flight_plan.aims import away, bearing_between
from sitl.autopilot.flight_plan.patterns import MIN_PIECE_LENGTH, Piece, has_arrived

TURN_LEAD = math.sqrt(3.0)  # of the middle circle of a U-turn ahead of the line's end, in radii
MIN_TURN = 0.2 * math.pi  # on the circle into the first sweep [rad]
ENTRY_DEPTH = 10.0  # below the survey's altitude at which the first sweep may begin [m]
HEIGHT_REACH = 1.0  # how near its altitude a rectangle's survey begins [m]


def line_pieces(l1: EnuPoint, l2: EnuPoint, radius: float) -> tuple[Piece, ...]:
    """To the first point, a U-turn of three arcs, back to the second, and a U-turn there; for ever.

    Args:
        l1: Where the line leads first; its altitude is flown.
        l2: Its other end.
        radius: Of the turns [m].
    """
    size, length = abs(radius), away(l1, l2)
    if length < MIN_PIECE_LENGTH or size < MIN_PIECE_LENGTH:
        return ()
    l2 = l2._replace(z=l1.z)
    return (*_line_and_turn(l2, l1, size), *_line_and_turn(l1, l2, size))


def _line_and_turn(start: EnuPoint, end: EnuPoint, radius: float) -> tuple[Piece, ...]:
    """A leg, and behind its end a turn to the right, a wide one to the left and one to the right back onto the line."""
    length = away(start, end)
    x, y = (end.x - start.x) / length, (end.y - start.y) / length
    first = EnuPoint(end.x + radius * y, end.y - radius * x, end.z)
    middle = EnuPoint(end.x + TURN_LEAD * radius * x, end.y + TURN_LEAD * radius * y, end.z)
    last = EnuPoint(end.x - radius * y, end.y + radius * x, end.z)
    return (
        Piece(start, end),
        Piece(end, first, radius, bearing_between(first, middle)),
        Piece(end, middle, -radius, bearing_between(middle, last)),
        Piece(end, last, radius, bearing_between(last, end)),
    )


@dataclass(slots=True)
class Flower:
    """Legs through a centre, with arcs between them outside of a circle about it.

    Attributes:
        radius: Of the flower [m]: how far its edge is from its centre.
        part: How many legs and arcs have begun.
    """

    radius: float
    part: int
    _piece: Piece
    _was_outside: bool  # since the piece began
    _turns: bool = False  # on an arc

    @classmethod
    def begun(cls, centre: EnuPoint, edge: EnuPoint, p: EnuPoint) -> Flower:
        """A flower from where the vehicle is.

        Args:
            centre: Its altitude is flown.
            edge: A point of its edge.
            p: Position of the vehicle.
        """
        radius = away(centre, edge)
        return cls(radius, 0, _through(centre, p, radius), away(centre, p) > radius)

    def at(self, centre: EnuPoint, edge: EnuPoint, p: EnuPoint, turn: float, reach: float) -> Piece:
        """The piece to fly at this tick.

        Args:
            centre: Where it is now.
            edge: Where it is now.
            p: Position of the vehicle.
            turn: Radius of the arcs [m], positive: clockwise.
            reach: Distance within which a point counts as reached [m].
        """
        inside = away(centre, p) <= self.radius
        if self._was_outside and inside:
            self.radius = away(centre, edge)
            self._begin(_through(centre, p, self.radius), turns=False)
        elif not self._turns and not self._was_outside and (not inside or has_arrived(self._piece, p, reach)):
            bearing = bearing_between(centre, p) + turn / max(self.radius, MIN_PIECE_LENGTH)
            middle = EnuPoint(
                centre.x + self.radius * math.sin(bearing), centre.y + self.radius * math.cos(bearing), centre.z
            )
            self._begin(Piece(p, middle, turn), turns=True)
        self._was_outside |= self._turns and not inside
        return self._piece

    def _begin(self, piece: Piece, *, turns: bool) -> None:
        self._piece, self._turns, self._was_outside = piece, turns, False
        self.part += 1


def _through(centre: EnuPoint, p: EnuPoint, radius: float) -> Piece:
    """The leg from a point through a centre to the other side."""
    bearing = bearing_between(p, centre)
    end = EnuPoint(centre.x + radius * math.sin(bearing), centre.y + radius * math.cos(bearing), centre.z)
    return Piece(p._replace(z=centre.z), end)


@dataclass(slots=True)
class RectangleSurvey:
    """Lines over a rectangle and back again between them, from the corner that is nearest.

    Coordinates along the lines and across them are ``u`` and ``w``: north and east for lines north and south.

    Attributes:
        sweeps: How often the rectangle's far side was reached.
        part: How many legs have begun.
    """

    north_south: bool
    sweeps: int
    part: int
    _w: float  # of the present line
    _shift: float  # to the next line, with its sign
    _goes_up: bool  # whether the present line leads to greater u
    _across: float = 0.0  # the way to the next line that is flown now; 0: along a line
    _is_begun: bool = False
    _was_half: bool = False  # whether the last step was half a shift

    @classmethod
    def begun(cls, wp1: EnuPoint, wp2: EnuPoint, grid: float, p: EnuPoint, *, north_south: bool) -> RectangleSurvey:
        """A survey from where the vehicle is.

        Args:
            wp1: A corner.
            wp2: The corner opposite.
            grid: Between the lines [m].
            p: Position of the vehicle.
            north_south: Whether the lines run north and south, else east and west.
        """
        (low_u, high_u), (low_w, high_w) = _ranges(wp1, wp2, north_south=north_south)
        u, w = (p.y, p.x) if north_south else (p.x, p.y)
        nearer_low = abs(w - low_w) < abs(w - high_w)
        first = low_w + grid / 4.0 if nearer_low else high_w - grid / 4.0
        return cls(north_south, 0, 0, first, grid if nearer_low else -grid, abs(u - low_u) <= abs(u - high_u))

    def at(self, wp1: EnuPoint, wp2: EnuPoint, p: EnuPoint, reach: float) -> Piece:
        """The piece to fly at this tick.

        Args:
            wp1: Where the first corner is now; its altitude is flown.
            wp2: Where the other is.
            p: Position of the vehicle.
            reach: Distance within which a point counts as reached [m].
        """
        (low_u, high_u), widths = _ranges(wp1, wp2, north_south=self.north_south)
        near, far = (low_u, high_u) if self._goes_up else (high_u, low_u)
        if not self._is_begun:
            start = self._point(near, self._w, wp1.z)
            if away(p, start) > reach or abs(p.z - start.z) > HEIGHT_REACH:
                return Piece(start, start)
            self._is_begun = True
            self.part += 1
        piece = self._piece(near, far, wp1.z)
        if has_arrived(piece, p, reach):
            self.part += 1
            if self._across:
                self._across = 0.0
            else:
                self._turn(*widths)
            near, far = (low_u, high_u) if self._goes_up else (high_u, low_u)
            piece = self._piece(near, far, wp1.z)
        return piece

    def _piece(self, near: float, far: float, z: float) -> Piece:
        if self._across:
            return Piece(self._point(near, self._w - self._across, z), self._point(near, self._w, z))
        return Piece(self._point(near, self._w, z), self._point(far, self._w, z))

    def _turn(self, low: float, high: float) -> None:
        """Choose the next line: a whole shift away, or half of one where there is no room for it, or turn back."""
        step = self._shift
        if not low <= self._w + step <= high:
            step = self._shift / 2.0
            if low <= self._w + step <= high:
                self._was_half = True
            else:
                self._shift = -self._shift
                step = self._shift if self._was_half else self._shift / 2.0
                self._was_half = False
                self.sweeps += 1
        self._across, self._w, self._goes_up = step, self._w + step, not self._goes_up

    def _point(self, u: float, w: float, z: float) -> EnuPoint:
        return EnuPoint(w, u, z) if self.north_south else EnuPoint(u, w, z)


def _ranges(wp1: EnuPoint, wp2: EnuPoint, *, north_south: bool) -> tuple[tuple[float, float], tuple[float, float]]:
    """Least and greatest coordinate of a rectangle along its lines, and across them [m]."""
    x, y = (min(wp1.x, wp2.x), max(wp1.x, wp2.x)), (min(wp1.y, wp2.y), max(wp1.y, wp2.y))
    return (y, x) if north_south else (x, y)


@dataclass(slots=True)
class PolygonSurvey:
    """Sweeps over a convex polygon, with half a circle from each to the next; it begins at the first corner.

    Points are (along, across): along the sweeps and across them.

    Attributes:
        sweeps: How many sweeps are done.
        returns: How often the polygon's end was reached.
        part: How many legs and arcs have begun.
    """

    z: float
    _turn: float  # of the sweeps, anticlockwise from east [rad]
    _corners: tuple[tuple[float, float], ...]
    _step: float  # to the next sweep, with its sign [m]
    _leg: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))
    _circle: tuple[float, float] | None = None  # centre of the present arc
    _turned: float = 0.0  # on it [rad]
    _bearing: float | None = None
    sweeps: int = 0
    returns: int = 0
    part: int = 0

    @classmethod
    def begun(cls, corners: Sequence[EnuPoint], spacing: float, orientation: float) -> PolygonSurvey | None:
        """A survey; None: the polygon has no area.

        Args:
            corners: In order around the polygon; the survey begins at the first, and at its altitude.
            spacing: Between the sweeps [m].
            orientation: Of the sweeps, anticlockwise from east [rad].
        """
        cos, sin = math.cos(orientation), math.sin(orientation)
        turned = tuple((c.x * cos + c.y * sin, c.y * cos - c.x * sin) for c in corners)
        if len(turned) < 3 or not abs(spacing) > MIN_PIECE_LENGTH:
            return None
        low, high = min(y for _, y in turned), max(y for _, y in turned)
        entry = turned[0]
        step = -abs(spacing) if entry[1] >= 0.5 * (low + high) else abs(spacing)
        survey = cls(corners[0].z, orientation, turned, step)
        across = entry[1] + 0.5 * step
        ends = survey._ends(across)
        if ends is None:
            return None
        near, far = sorted(ends, key=lambda x: abs(x - entry[0]))
        survey._leg = ((near, across), (far, across))
        survey._circle = (near, entry[1])
        return survey

    def at(self, p: EnuPoint, reach: float) -> Piece:
        """The piece to fly at this tick.

        Args:
            p: Position of the vehicle.
            reach: Distance within which a point counts as reached [m].
        """
        if self._circle is not None:
            return self._on_circle(self._circle, p)
        piece = Piece(self._world(self._leg[0]), self._world(self._leg[1]))
        if not has_arrived(piece, p, reach):
            return piece
        self._next_sweep()
        return self.at(p, reach)

    def _on_circle(self, centre: tuple[float, float], p: EnuPoint) -> Piece:
        middle = self._world(centre)
        sense = math.copysign(1.0, self._leg[1][0] - self._leg[0][0])
        radius = 0.5 * self._step * sense
        leaving = -self._turn if self._step > 0.0 else math.pi - self._turn
        bearing = bearing_between(middle, p)
        if self._bearing is not None:
            self._turned += abs(math.remainder(bearing - self._bearing, math.tau))
        self._bearing = bearing
        ready = self.sweeps > 0 or (self._turned > MIN_TURN and p.z > self.z - ENTRY_DEPTH)
        remaining = math.copysign(1.0, radius) * math.remainder(leaving - bearing, math.tau)
        if ready and self._turned > 0.0 and abs(remaining) < math.radians(10.0):
            self._circle, self._bearing, self._turned = None, None, 0.0
            self.part += 1
            return Piece(self._world(self._leg[0]), self._world(self._leg[1]))
        return Piece(middle, middle, radius, leaving)

    def _next_sweep(self) -> None:
        """Half a circle onto the next sweep, back over the polygon where there is none."""
        (start, across), (last, _) = self._leg
        low, high = min(y for _, y in self._corners), max(y for _, y in self._corners)
        turns_back = not low < across + self._step < high
        if turns_back:
            self._step = -self._step
            self.returns += 1
        following = across + (0.5 if turns_back else 1.0) * self._step
        ends = self._ends(following) or (start, last)
        goes_up = last > start
        if min(ends) < last < max(ends):
            end = min(ends) if goes_up else max(ends)
        else:
            end = max(ends, key=lambda x: abs(x - last))
        begin = ends[0] if end == ends[1] else ends[1]
        beside = last if abs(last - end) > abs(begin - end) else begin
        self._circle = (beside, across if turns_back else across + 0.5 * self._step)
        self._leg = ((begin, following), (end, following))
        self._bearing, self._turned = None, 0.0
        self.sweeps += 1
        self.part += 1

    def _ends(self, across: float) -> tuple[float, float] | None:
        """Ends of a line across the polygon, at its two crossings of the outline; None: it does not meet it."""
        found = []
        for (x1, y1), (x2, y2) in zip(self._corners, (*self._corners[1:], self._corners[0]), strict=True):
            if (y1 > across) != (y2 > across):
                found.append(x1 + (across - y1) / (y2 - y1) * (x2 - x1))
        return (min(found), max(found)) if len(found) > 1 else None

    def _world(self, point: tuple[float, float]) -> EnuPoint:
        cos, sin = math.cos(self._turn), math.sin(self._turn)
        return EnuPoint(point[0] * cos - point[1] * sin, point[0] * sin + point[1] * cos, self.z)
