"""Off the ground straight up: nothing moves sideways near it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl.control.reference import Point, Reference, at, upright
from sitl.guidance.limits import MIN_HOLD_HEIGHT
from sitl.guidance.view import VehicleView

CLEAR_MARGIN = 0.3  # below the least height of a hold, the way sideways begins [m]
STRAIGHT_UP = 0.5  # a reference nearer than this leads straight up anyway [m]
MAX_RISE_STEP = 0.1  # longest time that the reference rises at once [s]


@dataclass(slots=True)
class LiftOff:
    """Keeps the reference above where the vehicle stood until it is clear of the ground; one for a vehicle."""

    _stood: Point | None = None  # where the flight began; None: it is clear of the ground
    _up: float = 0.0  # how high the reference has risen [m]
    _time: float = 0.0  # of the last tick [s]

    def applied(self, reference: Reference, view: VehicleView, climb_rate: float, *, landing: bool) -> Reference:
        """The reference of this tick.

        Args:
            reference: Where the vehicle is to go.
            view: The vehicle as it is now.
            climb_rate: How fast it rises [m/s].
            landing: Whether it is going to stand on the ground.
        """
        passed = min(max(view.time - self._time, 0.0), MAX_RISE_STEP)
        self._time = view.time
        if view.landed:
            self._stood, self._up = view.p, view.p[2]
        elif landing or view.p[2] >= MIN_HOLD_HEIGHT - CLEAR_MARGIN:
            self._stood = None
        if self._stood is None or reference.steered:
            return reference
        x, y, _ = self._stood
        to = reference.position
        if not reference.forward and math.hypot(to.x - x, to.y - y) < STRAIGHT_UP:
            return reference
        self._up += climb_rate * passed
        return at(upright(reference), (x, y, min(self._up, max(to.z, MIN_HOLD_HEIGHT))))
