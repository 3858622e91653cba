"""The heading that the hover laws are handed: turned at a bounded rate, and edge-on where a wind is held.

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
from sitl.guidance.limits import MAX_HEADING_RATE, MAX_HEADING_STEP
from sitl.guidance.view import VehicleView

RIDES_WIND = frozenset({Law.TO_HOVER, Law.INDI})  # laws that hold in any wind
HELD_SPEED = 5.0  # slower than this, they hold in a wind rather than brakes [m/s]
LANDING_WIND = 1.5  # a landing turns the span into a wind from this on [m/s]
MAX_UNAIDED_WIND = 3.0  # in which a vehicle whose position nothing tells turns no more [m/s]


@dataclass(slots=True)
class SafeHeading:
    """Chooses the heading of every tick; one for a vehicle."""

    _last: float | None = None  # handed out [rad]; None: nothing was, or no hover law followed it
    _edge_on: float | None = None  # the heading in the wind [rad]; None: that of the reference
    _time: float = 0.0  # of the last tick [s]

    def applied(
        self,
        reference: Reference,
        view: VehicleView,
        *,
        steered: bool = False,
        landing: bool = False,
        unaided: bool = False,
    ) -> Reference:
        """The reference with the heading of this tick.

        On the ground and in forward flight no law follows the heading: it may be any. From there, and from an attitude
        that was flown, the turn begins at the vehicle's own.

        Args:
            reference: With the wanted heading.
            view: The vehicle as it is now.
            steered: Somebody steers the heading: it is not turned into the wind, and small steps of it are handed on.
            landing: Whether it is going to stand on the ground.
            unaided: Nothing tells the position: in a turn, wrong accelerations turn along and no longer cancel.
        """
        step = MAX_HEADING_RATE * max(view.time - self._time, 0.0)
        self._time = view.time
        if unaided and not reference.forward and math.hypot(view.wind[0], view.wind[1]) < MAX_UNAIDED_WIND:
            self._edge_on = view.heading if self._last is None else self._last
        else:
            self._choose(reference, view, steered=steered, landing=landing)
        wanted = math.remainder(reference.heading if self._edge_on is None else self._edge_on, math.tau)
        if view.landed or view.forward or reference.forward or reference.steered:
            self._last = None
            return reference._replace(heading=wanted)
        last = view.heading if self._last is None else self._last
        left = math.remainder(wanted - last, math.tau)
        is_small = steered and abs(math.remainder(wanted - view.heading, math.tau)) <= MAX_HEADING_STEP
        self._last = wanted if is_small or abs(left) <= step else last + math.copysign(step, left)
        return reference._replace(heading=self._last)

    def _choose(self, reference: Reference, view: VehicleView, *, steered: bool, landing: bool) -> None:
        """Turn the span into the wind, or end that."""
        if steered or reference.forward or view.landed:
            self._edge_on = None
        elif math.hypot(*view.v) < HELD_SPEED and (landing or view.law in RIDES_WIND):
            base = reference.heading if self._edge_on is None else self._edge_on
            self._edge_on = crosswind_heading(base, view.wind, LANDING_WIND if landing else LIGHT_WIND)
        else:
            self._edge_on = None
