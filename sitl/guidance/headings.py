"""Headings of the hover: turns that are asked for, and the one that the laws are handed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from protocol.dialect.vocabulary import Law
from sitl.control.reference import Reference
from sitl.guidance.legs import LIGHT_WIND, crosswind_heading
from sitl.guidance.view import MAX_HEADING_RATE, MAX_HEADING_STEP, VehicleView

# A turn of the heading on the spot, as MAV_CMD_CONDITION_YAW asks for it.
#
# https://mavlink.io/en/messages/common.html#MAV_CMD_CONDITION_YAW

CLOCKWISE, ANTICLOCKWISE = 1.0, -1.0  # of its param3; 0 takes the shorter way
HEADING_REACHED = math.radians(5.0)  # nearer than this the heading is reached [rad]
NO_TURN = math.radians(1.0)  # a turn to where the heading is already is not a whole one [rad]


@dataclass(slots=True)
class YawTurn:
    """Leads the heading to its end at a rate."""

    heading: float  # wanted now [rad]
    remaining: float  # still to be turned [rad]; positive: anticlockwise
    rate: float  # [rad/s]
    time: float  # of the last tick [s]

    @classmethod
    def of(cls, params: Sequence[float], view: VehicleView) -> YawTurn:
        """The turn that the parameters of the command ask for.

        Args:
            params: Its first four: angle [deg], rate [deg/s], direction, whether the angle is relative.
            view: The vehicle as it is now.
        """
        angle, rate, direction, relative = (0.0 if math.isnan(value) else value for value in params)
        if relative == 1.0:
            remaining = -math.radians(angle) * (direction or CLOCKWISE)
        else:
            remaining = math.remainder(-math.radians(angle) - view.heading, math.tau)
            if abs(remaining) > NO_TURN and remaining * direction > 0.0:  # a clockwise turn makes the heading smaller
                remaining -= math.copysign(math.tau, remaining)
        wanted = math.radians(rate) if rate > 0.0 else MAX_HEADING_RATE
        return cls(view.heading, remaining, min(wanted, MAX_HEADING_RATE), view.time)

    def update(self, view: VehicleView) -> float:
        """The heading at this tick [rad]."""
        step = min(self.rate * max(view.time - self.time, 0.0), abs(self.remaining))
        self.time = view.time
        self.heading += math.copysign(step, self.remaining)
        self.remaining -= math.copysign(step, self.remaining)
        return self.heading

    def done(self, view: VehicleView) -> bool:
        """Whether the vehicle has the heading."""
        return self.remaining == 0.0 and abs(math.remainder(view.heading - self.heading, math.tau)) < HEADING_REACHED


# The heading that the hover laws are handed: turned at a bounded rate, and edge-on where a wind is held.
#
# A step of the heading beyond 90 deg tips the linear hover law over by metres, which near the ground ends on it. And
# with the belly or the back to a wind, TO_HOVER can be drawn upwind for minutes with the elevons at their stops, and a
# vehicle that stands on its tail falls over.


RIDES_WIND = frozenset({Law.TO_HOVER, Law.INDI})  # laws that hold in any wind
HELD_SPEED = 5.0  # slower than this, they hold in a wind rather than brakes [m/s]
LANDING_WIND = 1.5  # a landing turns the span into a wind from this on [m/s]
# Between facing a strong wind and standing edge-on in it, elevons have no travel left: it is passed at once.
SWING_WIND = 6.0  # [m/s]
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
        unheeded = view.forward and view.law is not Law.INDI  # which follows it as soon as it hovers, however it leans
        if view.landed or unheeded or reference.forward or reference.steered:
            self._last = None
            return reference._replace(heading=wanted)
        last = view.heading if self._last is None else self._last
        left = math.remainder(wanted - last, math.tau)
        is_small = steered and abs(math.remainder(wanted - view.heading, math.tau)) <= MAX_HEADING_STEP
        swings = view.law is Law.INDI and math.hypot(view.wind[0], view.wind[1]) > SWING_WIND
        self._last = wanted if is_small or swings or abs(left) <= step else last + math.copysign(step, left)
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
