"""The heading that the hover laws are handed: turned to the one wanted at a bounded rate, edge-on where wind is held.

A step of the heading beyond 90 deg tips the linear hover law over by metres, which near the ground ends on it. And with
the belly or the back to a wind, TO_HOVER can be drawn upwind for minutes with the elevons at their stops.
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


@dataclass(slots=True)
class HeadingSlew:
    """Follows the wanted heading; one for a vehicle."""

    _heading: float | None = None  # handed out last [rad]; None: nothing was, or no hover law followed it
    _edge_on: float | None = None  # the heading in the wind that is held [rad]
    _time: float = 0.0  # of the last tick [s]

    def turned(self, reference: Reference, view: VehicleView, *, may_turn: bool = True) -> Reference:
        """The reference with the heading of this tick.

        On the ground and in forward flight no law follows the heading: it may be any. From there, and from an attitude
        that was flown, the turn begins at the vehicle's own.

        Args:
            reference: With the wanted heading.
            view: The vehicle as it is now.
            may_turn: Whether the span may be turned into a wind that is held: nobody steers the heading.
        """
        step = MAX_HEADING_RATE * max(view.time - self._time, 0.0)
        self._time = view.time
        if may_turn and _holds_in_wind(reference, view):
            base = reference.heading if self._edge_on is None else self._edge_on
            self._edge_on = crosswind_heading(base, view.wind)
            reference = reference._replace(heading=self._edge_on)
        else:
            self._edge_on = None
        if view.landed or view.forward or reference.forward or reference.steered:
            self._heading = None
            return reference
        last = view.heading if self._heading is None else self._heading
        left = math.remainder(reference.heading - last, math.tau)
        self._heading = reference.heading if abs(left) <= step else last + math.copysign(step, left)
        return reference._replace(heading=self._heading)


def _holds_in_wind(reference: Reference, view: VehicleView) -> bool:
    slow = math.hypot(*view.v) < HELD_SPEED and math.hypot(view.wind[0], view.wind[1]) > LIGHT_WIND
    return slow and view.law is Law.TO_HOVER and not reference.forward
