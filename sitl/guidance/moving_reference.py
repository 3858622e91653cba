"""The hover reference that moves with a velocity: that of a streamed set-point or of a pilot's sticks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from sitl.control.reference import Point, Reference, hover_at
from sitl.guidance.limits import MIN_HOLD_HEIGHT
from sitl.guidance.view import VehicleView

MAX_LEAD = 5.0  # of the reference over the vehicle; at 3 m/s the hover law trails by 4 m [m]
HEADING_LAG = 0.45  # by which the linear hover law trails a turning heading (physical: 0.33, nominal: 0.56) [s]
MAX_HEADING_LEAD = math.radians(30.0)  # of a turning heading over that of the vehicle


class HeadingSetpoint(NamedTuple):
    """The heading that a set-point asks for, or how fast it turns; with neither, the last heading stays."""

    heading: float | None = None  # [rad]
    turn_rate: float = 0.0  # [rad/s]


KEEP_HEADING = HeadingSetpoint()


@dataclass(slots=True)
class MovingReference:
    """A hover reference that moves with a velocity, never far from the vehicle."""

    _moved_at: float = 0.0  # time of the last move [s]
    _turned_to: float | None = None  # heading that a turn has come to [rad]; None: it does not turn

    def restart(self, time: float) -> None:
        """The next move begins now [s]."""
        self._moved_at = time

    def elapsed(self, time: float) -> float:
        """Time since the last move [s]."""
        return time - self._moved_at

    def move(
        self, v: Point, heading: HeadingSetpoint, last: Reference, view: VehicleView, max_step: float
    ) -> Reference:
        """The next reference.

        Args:
            v: Velocity, world NWU [m/s].
            heading: Of the vehicle.
            last: The reference in force.
            view: The vehicle as it is now.
            max_step: The move covers no more time than this [s].
        """
        here, dt = view.p, self._step(view.time, max_step)
        p = [last.position[i] + dt * v[i] for i in range(3)]
        away = math.dist(p, here)
        if away > MAX_LEAD:
            p = [here[i] + (p[i] - here[i]) * MAX_LEAD / away for i in range(3)]
        p[2] = max(p[2], MIN_HOLD_HEIGHT)
        return hover_at((p[0], p[1], p[2]), self._turn(heading, last.heading, view.heading, dt), last.speed)

    def _turn(self, wanted: HeadingSetpoint, last: float, now: float, dt: float) -> float:
        """The next heading [rad]: while it turns, it leads by the lag of the laws; a turn that ends stays there."""
        before = last if self._turned_to is None else self._turned_to
        if wanted.heading is not None or wanted.turn_rate == 0.0:
            stays = last if self._turned_to is None else now
            self._turned_to = None
            return stays if wanted.heading is None else wanted.heading
        ahead = math.remainder(before + wanted.turn_rate * dt - now, math.tau)
        self._turned_to = now + min(max(ahead, -MAX_HEADING_LEAD), MAX_HEADING_LEAD)
        return self._turned_to + HEADING_LAG * wanted.turn_rate

    def _step(self, time: float, max_step: float) -> float:
        since, self._moved_at = self._moved_at, time
        return min(max(time - since, 0.0), max_step)


def from_heading_axes(v: Point, heading: float) -> Point:
    """A vector forward, to the left and up at a heading [rad], in world NWU."""
    c, s = math.cos(heading), math.sin(heading)
    return (c * v[0] - s * v[1], s * v[0] + c * v[1], v[2])
