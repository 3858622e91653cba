"""Patterns of legs and arcs, take-offs and landings, and aims of the guided mode."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from protocol.flight_plans.flight_plan import EnuPoint
from sitl.autopilot.flight_plan.aims import Aim, AimKind, away, bearing_between
from sitl.autopilot.flight_plan.plan_state import PlanState

# Ovals, figures of eight and surveys as legs and arcs that follow each other for ever.

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


# Set-points of the guided mode, which a stage or a call gives: each of four values as the flags say.


XY_OFFSET, XY_BODY, Z_OFFSET, YAW_OFFSET, XY_SPEED, Z_SPEED, YAW_RATE = 1, 2, 4, 8, 32, 64, 128


def guided_aim(state: PlanState, flags: int, values: Sequence[float]) -> Aim:
    """The aim of a set-point; offsets count from where the vehicle is now.

    Args:
        state: Of the plan in flight; its heading is set unless the flags say a rate.
        flags: GUIDED_FLAG_...
        values: North, east, down [m or m/s] and yaw [rad or rad/s].
    """
    north, east, down, yaw = values
    view, p = state.inputs.view, state.p
    if flags & XY_BODY:
        psi = -view.heading
        north, east = (
            north * math.cos(psi) - east * math.sin(psi),
            north * math.sin(psi) + east * math.cos(psi),
        )
    turn_rate = yaw if flags & YAW_RATE else 0.0
    if not flags & YAW_RATE:
        state.memory.heading = (-view.heading if flags & YAW_OFFSET else 0.0) + yaw
    z = p.z - down if flags & Z_OFFSET else -down
    climb = -down if flags & Z_SPEED else None
    moved = bool(flags & (XY_OFFSET | XY_BODY))
    if flags & XY_SPEED:
        aim = Aim(AimKind.VELOCITY, start=EnuPoint(0.0, 0.0, z), end=EnuPoint(east, north, z))
    else:
        to = EnuPoint(east + (p.x if moved else 0.0), north + (p.y if moved else 0.0), z)
        aim = Aim(AimKind.POINT, end=to)
    return aim._replace(climb=climb, turn_rate=turn_rate)


# Take-offs and landings of Paparazzi's navigation modules.
#
# ``nav_takeoff_and_landing`` as its rotorcraft fly it; ``nav_skid_landing`` down to its touch-down point, where a
# tail-sitter stands upright and sinks instead of sliding.


TAKEOFF_HEIGHT = 2.0  # above the start, where a take-off ends [m]
MOTOR_TIME = 1.0  # after which motors that do not turn end a take-off [s]
AF_HEIGHT = 5.0  # of the point where a descent begins above its end [m]
FLARE_HEIGHT = 2.0  # above the touch-down point, where a descent goes on straight down [m]
MIN_GLIDE = 1.0  # a shorter way to the touch-down point is flown straight down [m]
SKID_MARGIN = 5.0  # above the approach point's altitude, where the circle down ends [m]
QUADRANT = math.radians(10.0)  # how near to a bearing is there [rad]


class Move(NamedTuple):
    """The piece that a take-off or a landing flies at this tick, and its vertical speed."""

    piece: Piece
    climb: float | None = None  # vertical speed [m/s]; None: the altitude of the piece
    part: int = 0  # steps begun


@dataclass(slots=True)
class TakeOff:
    """Start the motors and climb straight up, a little."""

    start: EnuPoint
    begun: float  # [s]
    is_climbing: bool = False

    def at(self, p: EnuPoint, now: float, speed: float, *, armed: bool) -> Move | None:
        """The piece to fly at this tick; None: the take-off is done, or the motors did not start.

        Args:
            p: Position of the vehicle.
            now: [s].
            speed: Of the climb [m/s].
            armed: Whether the motors may turn.
        """
        if p.z - self.start.z > TAKEOFF_HEIGHT:
            return None
        if not armed and (self.is_climbing or now - self.begun > MOTOR_TIME):
            return None
        self.is_climbing |= armed
        return Move(Piece(self.start, self.start), speed if armed else 0.0)


@dataclass(slots=True)
class Descent:
    """To a point where the descent begins, down along a leg if it leads away, and straight down to the ground."""

    td: EnuPoint  # above the ground by the flare's height
    af: EnuPoint
    step: int = 0

    def at(self, p: EnuPoint, speed: float, reach: float, *, landed: bool) -> Move | None:
        """The piece to fly at this tick; None: the vehicle stands on the ground.

        Args:
            p: Position of the vehicle.
            speed: Of the descent, negative [m/s].
            reach: Distance within which a point counts as reached [m].
            landed: Whether it stands on the ground.
        """
        if landed:
            return None
        glides = away(self.af, self.td) > MIN_GLIDE
        leg = Piece(self.af, self.td)
        if self.step == 0 and away(p, self.af) < reach:
            self.step = 1
        if self.step == 1 and (not glides or has_arrived(leg, p, reach) or p.z < self.td.z):
            self.step = 2
        if self.step == 0:
            return Move(Piece(self.af, self.af), None, 0)
        if self.step == 1:
            return Move(leg, None, 1)
        return Move(Piece(self.td, self.td), speed, 2)


@dataclass(slots=True)
class SkidLanding:
    """Circle down beside the approach point, half a turn at its altitude, and a glide to the touch-down point."""

    radius: float  # [m], positive: clockwise
    step: int = 0
    _turned: float = 0.0
    _bearing: float | None = None

    def at(self, af: EnuPoint, td: EnuPoint, p: EnuPoint, speed: float, reach: float) -> Move:
        """The piece to fly at this tick.

        Args:
            af: The approach point, at the altitude of the circle.
            td: The touch-down point.
            p: Position of the vehicle.
            speed: Of the last descent, negative [m/s].
            reach: Distance within which a point counts as reached [m].
        """
        length = max(away(af, td), 1e-6)
        x, y = (td.x - af.x) / length, (td.y - af.y) / length
        centre = EnuPoint(af.x + y * self.radius, af.y - x * self.radius, af.z)
        sense = math.copysign(1.0, self.radius)
        bearing, at_af = bearing_between(centre, p), bearing_between(centre, af)
        if self._bearing is not None:
            self._turned += sense * math.remainder(bearing - self._bearing, math.tau)
        self._bearing = bearing
        if self.step == 0 and p.z < af.z + SKID_MARGIN:
            self.step, self._turned = 1, 0.0
        elif self.step == 1 and self._turned > math.pi and _is_near(bearing, at_af - 0.5 * math.pi * sense):
            self.step = 2
        elif self.step == 2 and _is_near(bearing, at_af - 0.25 * math.pi * sense):
            self.step = 3
        elif self.step == 3 and has_arrived(Piece(af, td), p, reach):
            self.step = 4
        above = td._replace(z=td.z + FLARE_HEIGHT)
        if self.step == 4:
            return Move(Piece(above, above), speed, 2)
        if self.step == 3:
            return Move(Piece(af, above), None, 1)
        return Move(Piece(centre, centre, self.radius), None, 0)


def _is_near(bearing: float, wanted: float) -> bool:
    return abs(math.remainder(bearing - wanted, math.tau)) < QUADRANT
