"""What is streamed to the vehicle and flown only while it keeps coming: a program's set-points, a pilot's sticks."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl.autopilot.choice import Chooser
from sitl.autopilot.guidance import FASTEST, SLOWEST, FlyTo, Guidance, Setpoint, Vector, View
from sitl.autopilot.legs import FlyLeg, course
from sitl.autopilot.manual import TURN_RATE, Sticks
from sitl.autopilot.settings import Settings

__all__ = ["FLOOR", "Streamed", "is_same_leg", "refuse_velocity"]

CLIMB, DESCENT = 2.5, 2.0  # vertical speeds the hover flies [m/s]
LEASH = 5.0  # a velocity set-point leads the vehicle by no more; the hover law trails 3 m/s by 4 m [m]
SAME_LEG = 5.0  # a streamed position that moved less than this is the same leg [m]
FLOOR = 1.0  # a hold asked for nearer the ground than this is flown here [m]


@dataclass(slots=True)
class Streamed:
    """The last set-point and the last sticks, and when they came on simulated time.

    ``setpoint`` is the one OFFBOARD starts with.
    """

    setpoint: Setpoint
    _came: float | None = None
    _moved: float = 0.0  # when a velocity last moved a set-point
    _sticks: tuple[float, Sticks] | None = None

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
        """Velocities move the set-point from now on."""
        self._moved = time

    def velocity(self, v: Vector, heading: float | None, last: Setpoint, view: View, settings: Settings) -> Setpoint:
        """The set-point of a velocity: upright it moves along, on the wing it is a course.

        Args:
            v: World NWU [m/s]; one that :func:`refuse_velocity` lets pass.
            heading: [rad]; None keeps the last one.
            last: The set-point in force.
            view: The vehicle as it is now.
            settings: With the hover's speed limit and the time-out.
        """
        if _is_hovered(v, settings):
            return self._drift(v, heading, last, view, settings)
        return course(view.p, v, view.wind, last)

    def follow(self, sticks: Sticks, last: Setpoint, view: View, settings: Settings) -> Setpoint:
        """The set-point that sticks move, upright."""
        since = self._moved
        v = sticks.velocity(last.heading, settings.hover_speed, CLIMB, DESCENT)
        moved = self._drift(v, last.heading, last, view, settings)
        return moved._replace(heading=last.heading - TURN_RATE * sticks.clockwise * (view.time - since))

    def _drift(self, v: Vector, heading: float | None, last: Setpoint, view: View, settings: Settings) -> Setpoint:
        """A set-point that moves at a velocity, never far from the vehicle."""
        here, dt = view.p, self._step(view.time, settings)
        p = [last.p[i] + dt * v[i] for i in range(3)]
        away = math.dist(p, here)
        if away > LEASH:
            p = [here[i] + (p[i] - here[i]) * LEASH / away for i in range(3)]
        p[2] = max(p[2], FLOOR)
        return Setpoint((p[0], p[1], p[2]), last.heading if heading is None else heading, last.speed)

    def _step(self, time: float, settings: Settings) -> float:
        since, self._moved = self._moved, time
        return min(max(time - since, 0.0), settings.setpoint_timeout)


def refuse_velocity(v: Vector, settings: Settings, chooser: Chooser | None) -> str | None:
    """Why a velocity, world NWU [m/s], cannot be flown, or None.

    Up to the hover's speed limit it is flown upright, from 7 m/s on on the wing; between the two the vehicle can hold
    no speed for long.
    """
    if _is_hovered(v, settings):
        return None
    level = math.hypot(v[0], v[1])
    if not SLOWEST <= level <= FASTEST:
        return f"{level:.1f} m/s level, {v[2]:.1f} m/s up: hover to {settings.hover_speed:g}, wing from {SLOWEST:g}"
    if chooser is None or not chooser.can_fly_forward:
        return f"{level:.1f} m/s: this airframe cannot leave the hover"
    return None


def is_same_leg(guidance: Guidance | None, target: Setpoint) -> bool:
    """Whether what is flown now already leads to a set-point; a small step moves it there."""
    if not isinstance(guidance, FlyTo | FlyLeg) or math.dist(guidance.setpoint.p, target.p) > SAME_LEG:
        return False
    if isinstance(guidance, FlyTo):
        guidance.setpoint = target
    return True


def _is_hovered(v: Vector, settings: Settings) -> bool:
    return math.hypot(v[0], v[1]) <= settings.hover_speed and -DESCENT <= v[2] <= CLIMB
