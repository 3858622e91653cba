"""Take-offs and landings of Paparazzi's navigation modules.

``nav_takeoff_and_landing`` as its rotorcraft fly it; ``nav_skid_landing`` down to its touch-down point, where a
tail-sitter stands upright and sinks instead of sliding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from protocol.flight_plans.flight_plan import EnuPoint
from sitl.autopilot.flight_plan.aims import away, bearing_between
from sitl.autopilot.flight_plan.patterns import Piece, has_arrived

__all__ = ["FLARE_HEIGHT", "Descent", "Move", "SkidLanding", "TakeOff"]

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
