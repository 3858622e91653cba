"""The heading that the hover laws are handed: turned to the one wanted at a bounded rate, edge-on where wind is held.

A step of the heading beyond 90 deg tips the linear hover law over by metres, which near the ground ends on it. And with
the belly or the back to a wind, TO_HOVER can be drawn upwind for minutes with the elevons at their stops, and a vehicle
that stands on its tail falls over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.dialect.vocabulary import Law
from sitl.control.reference import Reference
from sitl.guidance.legs import LIGHT_WIND, crosswind_heading
from sitl.guidance.limits import MAX_HEADING_RATE
from sitl.guidance.view import VehicleView

HELD_SPEED = 5.0  # slower than this, TO_HOVER holds in a wind rather than brakes [m/s]
LANDING_WIND = 1.5  # a landing turns the span into a wind from this on [m/s]
TURN_HEIGHT = 2.5  # lower than this, a landing turns no more [m]


@dataclass(slots=True)
class HeadingSlew:
    """Follows the wanted heading; one for a vehicle."""

    _heading: float | None = None  # handed out last [rad]; None: nothing was, or no hover law followed it
    _edge_on: float | None = None  # the heading in the wind [rad]; None: that of the reference
    _time: float = 0.0  # of the last tick [s]

    def turned(
        self, reference: Reference, view: VehicleView, *, may_turn: bool = True, landing: bool = False
    ) -> Reference:
        """The reference with the heading of this tick.

        On the ground and in forward flight no law follows the heading: it may be any. From there, and from an attitude
        that was flown, the turn begins at the vehicle's own.

        Args:
            reference: With the wanted heading.
            view: The vehicle as it is now.
            may_turn: Whether the span may be turned into a wind: nobody steers the heading.
            landing: Whether it is going to stand on the ground.
        """
        step = MAX_HEADING_RATE * max(view.time - self._time, 0.0)
        self._time = view.time
        self._turn_edge_on(reference, view, may_turn=may_turn, landing=landing)
        if self._edge_on is not None:
            reference = reference._replace(heading=self._edge_on)
        if view.landed or view.forward or reference.forward or reference.steered:
            self._heading = None
            return reference
        last = view.heading if self._heading is None else self._heading
        left = math.remainder(reference.heading - last, math.tau)
        self._heading = reference.heading if abs(left) <= step else last + math.copysign(step, left)
        return reference._replace(heading=self._heading)

    def _turn_edge_on(self, reference: Reference, view: VehicleView, *, may_turn: bool, landing: bool) -> None:
        slow = math.hypot(*view.v) < HELD_SPEED and not reference.forward and not view.landed
        if landing and view.p[2] < TURN_HEIGHT and self._heading is not None:
            self._edge_on = self._heading  # a turn would carry it aside as it touches the ground
        elif may_turn and slow and (landing or view.law is Law.TO_HOVER):
            base = reference.heading if self._edge_on is None else self._edge_on
            light = LANDING_WIND if landing else LIGHT_WIND
            self._edge_on = crosswind_heading(base, view.wind, light)
        else:
            self._edge_on = None
