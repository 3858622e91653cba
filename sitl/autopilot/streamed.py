"""What is streamed to the vehicle and flown only while it keeps coming: a program's set-points, a pilot's sticks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from sitl.autopilot.guidance import MAX_AIRSPEED, MIN_AIRSPEED, FlyTo, Guidance, View
from sitl.autopilot.legs import FlyLeg, course
from sitl.autopilot.manual import TURN_RATE, Sticks
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point, Reference, hover_at
from sitl.prediction.chooser import Chooser
from sitl.prediction.mode_choice import MAX_CLIMB_SLOPE, MAX_DESCENT_SLOPE

__all__ = ["FLOOR", "KEEP_FACING", "Facing", "Streamed", "is_same_leg", "level_out", "refuse_turn", "refuse_velocity"]

CLIMB, DESCENT = 2.5, 2.0  # vertical speeds the hover flies [m/s]
LEASH = 5.0  # a velocity leads the reference away from the vehicle by no more; the hover law trails 3 m/s by 4 m [m]
SAME_LEG = 5.0  # a streamed position that moved less than this is the same leg [m]
FLOOR = 1.0  # a hold asked for nearer the ground than this is flown here [m]
MAX_TURN_RATE = math.radians(20.0)  # of the heading: the hover laws follow no faster one evenly [rad/s]
HEADING_LAG = 2.0  # the hover laws trail a turning heading by so much of its turn [s]
HEADING_LEASH = math.radians(30.0)  # from where the vehicle looks, what a turn has come to is no further


class Facing(NamedTuple):
    """The heading that a set-point asks for, or how fast it turns; neither keeps the last one."""

    heading: float | None = None  # [rad]
    turn: float = 0.0  # [rad/s]


KEEP_FACING = Facing()


@dataclass(slots=True)
class Streamed:
    """The last set-point and the last sticks, and when they came on simulated time.

    ``reference`` is what OFFBOARD starts with.
    """

    reference: Reference
    _came: float | None = None
    _moved: float = 0.0  # when a velocity last moved the reference
    _sticks: tuple[float, Sticks] | None = None
    _turned: float | None = None  # what a heading that turns has come to [rad]; None: it does not turn
    _offset: tuple[Point, bool, Point] | None = None  # the last one, whether of the body, and where it was laid

    def arrived(self, time: float) -> None:
        """A set-point that can be flown arrived."""
        self._came = time

    def is_stale(self, time: float, settings: Settings) -> bool:
        """Whether set-points have stopped, or never came."""
        return self._came is None or time - self._came > settings.setpoint_timeout

    def take_sticks(self, sticks: Sticks, time: float) -> None:
        """Take a pilot's sticks."""
        self._sticks = (time, sticks)

    def sticks(self, time: float, settings: Settings) -> Sticks | None:
        """The pilot's sticks, None when they have stopped or never came."""
        if self._sticks is None or time - self._sticks[0] > settings.stick_timeout:
            return None
        return self._sticks[1]

    def start_moving(self, time: float) -> None:
        """Velocities move the reference from now on."""
        self._moved = time

    def lay(self, offset: Point, *, body: bool, view: View, settings: Settings) -> Point:
        """The place of an offset from the vehicle, world NWU [m].

        One that comes again, number for number, keeps the place: repeating it only keeps the stream alive.

        Args:
            offset: World NWU, or with ``body`` forward, to the left and up [m].
            body: Whether the heading turns it.
            view: The vehicle as it is now.
            settings: With the time-out, after which a repeated one is a new one.
        """
        known = self._offset
        if known is None or self.is_stale(view.time, settings) or known[:2] != (offset, body):
            away = level_out(offset, view.heading) if body else offset
            known = (offset, body, (view.p[0] + away[0], view.p[1] + away[1], view.p[2] + away[2]))
            self._offset = known
        return known[2]

    def velocity(self, v: Point, facing: Facing, last: Reference, view: View, settings: Settings) -> Reference:
        """The reference of a velocity: upright it moves along, in forward flight it is a course.

        Args:
            v: World NWU [m/s]; one that :func:`refuse_velocity` lets pass.
            facing: Used upright; forward flight looks where it flies.
            last: The reference in force.
            view: The vehicle as it is now.
            settings: With the hover's speed limit and the time-out.
        """
        if _is_hovered(v, settings):
            return self._drift(v, facing, last, view, settings)
        return course(view.p, v, view.wind, last)

    def follow(self, sticks: Sticks, last: Reference, view: View, settings: Settings) -> Reference:
        """The reference that sticks move, upright."""
        since = self._moved
        v = sticks.velocity(last.heading, settings.hover_speed, CLIMB, DESCENT)
        heading = last.heading - TURN_RATE * sticks.clockwise * (view.time - since)
        return self._drift(v, Facing(heading), last, view, settings)

    def _drift(self, v: Point, facing: Facing, last: Reference, view: View, settings: Settings) -> Reference:
        """A reference that moves at a velocity, never far from the vehicle."""
        here, dt = view.p, self._step(view.time, settings)
        p = [last.position[i] + dt * v[i] for i in range(3)]
        away = math.dist(p, here)
        if away > LEASH:
            p = [here[i] + (p[i] - here[i]) * LEASH / away for i in range(3)]
        p[2] = max(p[2], FLOOR)
        return hover_at((p[0], p[1], p[2]), self._face(facing, last.heading, view.heading, dt), last.speed)

    def _face(self, facing: Facing, last: float, now: float, dt: float) -> float:
        """The next heading [rad]: one that turns is set ahead by what the laws trail it, and back when it stops."""
        before = last if self._turned is None else self._turned
        if facing.heading is not None or facing.turn == 0.0:
            self._turned = None
            return before if facing.heading is None else facing.heading
        ahead = math.remainder(before + facing.turn * dt - now, math.tau)
        self._turned = now + min(max(ahead, -HEADING_LEASH), HEADING_LEASH)
        return self._turned + HEADING_LAG * facing.turn

    def _step(self, time: float, settings: Settings) -> float:
        since, self._moved = self._moved, time
        return min(max(time - since, 0.0), settings.setpoint_timeout)


def refuse_velocity(v: Point, settings: Settings, chooser: Chooser | None) -> str | None:
    """Why a velocity, world NWU [m/s], cannot be flown, or None.

    Up to the hover's speed limit it is flown upright, from 7 m/s on in forward flight; between the two the vehicle can
    hold no speed for long.
    """
    if _is_hovered(v, settings):
        return None
    level = math.hypot(v[0], v[1])
    if not MIN_AIRSPEED <= level <= MAX_AIRSPEED:
        return (
            f"{level:.1f} m/s level, {v[2]:.1f} m/s up: hover to {settings.hover_speed:g}, wing from {MIN_AIRSPEED:g}"
        )
    if not -MAX_DESCENT_SLOPE * level <= v[2] <= MAX_CLIMB_SLOPE * level:
        return f"{v[2]:.3g} m/s up at {level:.1f} m/s level is too steep for the wing"
    if chooser is None or not chooser.can_fly_forward:
        return f"{level:.1f} m/s: this airframe cannot leave the hover"
    return None


def refuse_turn(facing: Facing) -> str | None:
    """Why a rate of the heading cannot be flown, or None."""
    if abs(facing.turn) <= MAX_TURN_RATE + 1e-6:
        return None
    turn, most = math.degrees(abs(facing.turn)), math.degrees(MAX_TURN_RATE)
    return f"{turn:.0f} deg/s: the hover turns at {most:.0f} deg/s at most"


def level_out(v: Point, heading: float) -> Point:
    """What is forward, to the left and up at a heading [rad], in world NWU."""
    c, s = math.cos(heading), math.sin(heading)
    return (c * v[0] - s * v[1], s * v[0] + c * v[1], v[2])


def is_same_leg(guidance: Guidance | None, target: Reference) -> bool:
    """Whether what is flown now already leads to a reference; a small step moves it there."""
    if not isinstance(guidance, FlyTo | FlyLeg) or math.dist(guidance.reference.position, target.position) > SAME_LEG:
        return False
    if isinstance(guidance, FlyTo):
        guidance.reference = target
    return True


def _is_hovered(v: Point, settings: Settings) -> bool:
    return math.hypot(v[0], v[1]) <= settings.hover_speed and -DESCENT <= v[2] <= CLIMB
