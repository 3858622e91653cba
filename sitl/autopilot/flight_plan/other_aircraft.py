"""Other aircraft that were heard on the link: what a plan may follow."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from sitl.control.reference import Point

__all__ = ["HeardAircraft", "OtherAircraft"]

MAX_AIRCRAFT = 32  # that are remembered
LOST_AFTER = 3.0  # of silence [s]
STEADY_SPEED = 0.5  # above which an aircraft's velocity tells its course [m/s]


class HeardAircraft(NamedTuple):
    """Last reported position of another aircraft."""

    time: float  # when that was heard [s]
    p: Point  # world NWU [m]
    v: Point  # [m/s]
    course: float | None = None  # clockwise from north [rad]; None: it has not moved since it was first heard


@dataclass(slots=True)
class OtherAircraft:
    """The newest place of every aircraft, by its system id."""

    heard: dict[int, HeardAircraft] = field(default_factory=dict)

    def take(self, system: int, time: float, p: Point, v: Point) -> None:
        """An aircraft tells where it is; beyond so many of them the one that was silent longest is forgotten.

        Args:
            system: Its system id.
            time: Of arrival [s].
            p: Where it is, world NWU [m].
            v: Its velocity [m/s].
        """
        last = self.heard.pop(system, None)
        if last is None and len(self.heard) >= MAX_AIRCRAFT:
            del self.heard[min(self.heard, key=lambda other: self.heard[other].time)]
        moves = math.hypot(v[0], v[1]) > STEADY_SPEED
        course = math.atan2(-v[1], v[0]) if moves else (last.course if last is not None else None)
        self.heard[system] = HeardAircraft(time, p, v, course)

    def at(self, system: float, now: float) -> HeardAircraft | None:
        """An aircraft where it is by now [s] if it goes on as it did; None if it is not heard."""
        last = self.heard.get(round(system)) if math.isfinite(system) else None
        if last is None or now - last.time > LOST_AFTER:
            return None
        age = max(now - last.time, 0.0)
        x, y, z = (place + age * speed for place, speed in zip(last.p, last.v, strict=True))
        return last._replace(p=(x, y, z))
