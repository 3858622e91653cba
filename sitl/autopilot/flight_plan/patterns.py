"""Ovals, figures of eight and surveys as legs and arcs that follow each other for ever."""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.flight_plans.flight_plan import EnuPoint
from sitl.autopilot.flight_plan.aims import away, bearing_between

__all__ = ["MIN_PIECE_LENGTH", "Piece", "PieceTracker", "eight_pieces", "has_arrived", "oval_pieces", "survey_pieces"]

MAX_SWEEPS = 400  # lines of a survey
MAX_TURN = 2.0  # on an arc in one tick; more is the other side of the circle [rad]
LEGS_FORESEEN = 7
WIDE = 10.0  # radius of an arc that may be flown forward [m]
STRAIGHT_ON = 60.0  # [m]
MIN_PIECE_LENGTH = 1e-3  # what is shorter is no leg [m]


@dataclass(frozen=True, slots=True)
class Piece:
    """A leg, or an arc about ``end`` that ends at a bearing from there."""

    start: EnuPoint
    end: EnuPoint
    radius: float = 0.0  # of an arc [m], positive: clockwise; 0: a leg
    until: float = 0.0  # bearing at which an arc ends, clockwise from north [rad]


@dataclass(slots=True)
class PieceTracker:
    """The piece being flown; the next one follows past the line normal to a leg's end, or past the end of an arc."""

    pieces: tuple[Piece, ...]
    index: int = 0
    _remaining: float | None = None  # of the present arc, at the last tick [rad]

    def at(self, p: EnuPoint) -> Piece:
        """The piece to fly from a point."""
        piece = self.pieces[self.index % len(self.pieces)]
        if self._is_over(piece, p):
            self.index += 1
            self._remaining = None
            piece = self.pieces[self.index % len(self.pieces)]
        return piece

    def followers(self) -> tuple[EnuPoint, ...]:
        """Ends of the legs behind the present one; before a wide arc it leads straight on, so as not to stop."""
        following: list[EnuPoint] = []
        for ahead in range(1, LEGS_FORESEEN + 1):
            piece = self.pieces[(self.index + ahead) % len(self.pieces)]
            if piece.radius == 0.0:
                following.append(piece.end)
                continue
            if not following and abs(piece.radius) >= WIDE:
                following.append(_straight_on(self.pieces[self.index % len(self.pieces)]))
            break
        return tuple(following)

    def _is_over(self, piece: Piece, p: EnuPoint) -> bool:
        if piece.radius == 0.0:
            return _is_passed(piece, p)
        sense = math.copysign(1.0, piece.radius)
        remaining = sense * math.remainder(piece.until - bearing_between(piece.end, p), math.tau)
        before, self._remaining = self._remaining, remaining
        return before is not None and before > 0.0 >= remaining > before - MAX_TURN


def has_arrived(leg: Piece, p: EnuPoint, reach: float) -> bool:
    """Whether a vehicle is at the end of a leg: nearer than ``reach`` [m], or beyond the line normal to it there."""
    return away(p, leg.end) < reach or _is_passed(leg, p)


def _is_passed(leg: Piece, p: EnuPoint) -> bool:
    dx, dy = leg.end.x - leg.start.x, leg.end.y - leg.start.y
    return (p.x - leg.end.x) * dx + (p.y - leg.end.y) * dy >= 0.0


def oval_pieces(p1: EnuPoint, p2: EnuPoint, radius: float) -> tuple[Piece, ...]:
    """Two legs beside the line between two points, with half a turn about each; positive radius: clockwise.

    It begins with the turn about the second point.
    """
    length = away(p1, p2)
    if length < MIN_PIECE_LENGTH:
        return ()
    x, y = (p2.x - p1.x) / length, (p2.y - p1.y) / length
    left = EnuPoint(-y * radius, x * radius, 0.0)  # of the way from p1 to p2, where a clockwise oval leads along
    one, two = p1, EnuPoint(p2.x, p2.y, p1.z)
    there, back = (
        (_shifted(one, left, 1.0), _shifted(two, left, 1.0)),
        (_shifted(two, left, -1.0), _shifted(one, left, -1.0)),
    )
    return (
        Piece(there[1], two, radius, bearing_between(two, back[0])),
        Piece(*back),
        Piece(back[1], one, radius, bearing_between(one, there[0])),
        Piece(*there),
    )


def eight_pieces(center: EnuPoint, turn_around: EnuPoint, radius: float) -> tuple[Piece, ...]:
    """A figure of eight: half a turn about each of two points, one each way, and legs that cross between them.

    The turn about the second point is clockwise for a positive radius [m].
    """
    size = abs(radius)
    gap = away(center, turn_around)
    if gap < MIN_PIECE_LENGTH or size < MIN_PIECE_LENGTH:
        return ()
    x, y = (turn_around.x - center.x) / gap, (turn_around.y - center.y) / gap
    z = center.z
    one, two = EnuPoint(center.x, center.y, z), EnuPoint(turn_around.x, turn_around.y, z)
    sense = math.copysign(1.0, radius)
    # Clockwise about the second point the half turn begins on the left, seen from the first.
    left = EnuPoint(-y * size * sense, x * size * sense, 0.0)
    one_left, one_right = _shifted(one, left, 1.0), _shifted(one, left, -1.0)
    two_left, two_right = _shifted(two, left, 1.0), _shifted(two, left, -1.0)
    return (
        Piece(one_right, two_left),
        Piece(two_left, two, radius, bearing_between(two, two_right)),
        Piece(two_right, one_left),
        Piece(one_left, one, -radius, bearing_between(one, one_right)),
    )


def _straight_on(leg: Piece) -> EnuPoint:
    length = max(away(leg.start, leg.end), MIN_PIECE_LENGTH)
    share = STRAIGHT_ON / length
    dx, dy = leg.end.x - leg.start.x, leg.end.y - leg.start.y
    return EnuPoint(leg.end.x + share * dx, leg.end.y + share * dy, leg.end.z)


def _shifted(point: EnuPoint, by: EnuPoint, share: float) -> EnuPoint:
    return EnuPoint(point.x + share * by.x, point.y + share * by.y, point.z)


def survey_pieces(wp1: EnuPoint, wp2: EnuPoint, grid: float, *, north_south: bool) -> tuple[Piece, ...]:
    """Sweeps over the rectangle between two corners, and back again.

    Args:
        wp1: Where it begins; its altitude is flown.
        wp2: The corner opposite.
        grid: Between the lines [m].
        north_south: Whether the lines run north and south, else east and west.
    """
    step = max(abs(grid), 0.1)
    width = (wp2.x - wp1.x) if north_south else (wp2.y - wp1.y)
    lines = min(int(abs(width) / step) + 1, MAX_SWEEPS)
    points: list[EnuPoint] = []
    for line in range(lines):
        offset = math.copysign(line * step, width)
        ends = [
            EnuPoint(wp1.x + offset, y, wp1.z) if north_south else EnuPoint(x, wp1.y + offset, wp1.z)
            for x, y in ((wp1.x, wp1.y), (wp2.x, wp2.y))
        ]
        points += ends if line % 2 == 0 else ends[::-1]
    there_and_back = points + points[-2:0:-1]
    legs = zip(there_and_back, (*there_and_back[1:], there_and_back[0]), strict=True)
    return tuple(Piece(a, b) for a, b in legs if away(a, b) > MIN_PIECE_LENGTH)
