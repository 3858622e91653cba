"""A leg of a mission in forward flight: to a stop at its end, or past its waypoint to the next."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from protocol.plans.plan import MissionItem
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point, Reference
from sitl.guidance.leg_speeds import corner_cut, corner_lead, speed_along
from sitl.guidance.legs import FlyLeg, leg_reference
from sitl.guidance.waypoint_passing import MIN_REACH, Passage, is_left_turn

__all__ = ["PassedItems", "forward_leg"]


def forward_leg(
    item: MissionItem, end: Reference, flown: Sequence[Point], airspeed: float, wind: Point, settings: Settings
) -> FlyLeg:
    """The leg to the end of an item.

    Args:
        item: Its yaw is the heading at the end; the radius of a waypoint is how near it is passed.
        end: Hovering there.
        flown: Where the leg begins and ends, and the ends of the legs flown forward after it, world NWU [m].
        airspeed: [m/s].
        wind: As it is estimated, world NWU [m/s].
        settings: With what counts as near where the item says nothing.
    """
    start, point = flown[:2]
    radius, yaw = item.params[1], item.params[3]
    leg = leg_reference(start, point, end, airspeed, stop=len(flown) == 2)
    keeps_heading = math.isfinite(yaw)
    leg = leg._replace(heading=-math.radians(yaw) if keeps_heading else leg.heading)
    acceptance = radius if radius > 0.0 else settings.acceptance
    if len(flown) == 2:
        return FlyLeg(leg, acceptance, keep_heading=keeps_heading)
    speed = speed_along(start, point, airspeed, wind)
    if radius > 0.0:  # the turn to the next leg begins within the radius
        lead, reach = radius, max(radius, MIN_REACH)
    else:
        lead, reach = corner_lead(start, point, flown[2], speed), max(acceptance, corner_cut(speed))
    passage = Passage(reach, settings.height_acceptance, is_left_turn(start, point, flown[2]))
    return FlyLeg(leg, acceptance, lead=lead, keep_heading=keeps_heading, passage=passage)


@dataclass(slots=True)
class PassedItems:
    """Items that are done, told in their order: a waypoint only where the turn that began before it passes it.

    Attributes:
        told: Numbers of items, to be read and cleared.
    """

    told: list[int] = field(default_factory=list)
    _point: Point | None = None  # of the waypoint that is being passed, world NWU [m]
    _last: Point = (0.0, 0.0, 0.0)  # where the vehicle was at the last tick
    _waiting: list[int] = field(default_factory=list)

    def add(self, seq: int) -> None:
        """An item is done."""
        (self.told if self._point is None else self._waiting).append(seq)

    def begin_turn(self, point: Point, p: Point) -> None:
        """A turn begins at ``p`` that passes a waypoint: it is nearest where the vehicle moves away from it."""
        self.end_turn()
        self._point, self._last = point, p

    def update(self, p: Point) -> None:
        """The vehicle is at a point."""
        if self._point is None:
            return
        before, self._last = math.dist(self._last[:2], self._point[:2]), p
        if math.dist(p[:2], self._point[:2]) > before:
            self.end_turn()

    def end_turn(self) -> None:
        """Tell what waits."""
        self.told += self._waiting
        self._waiting, self._point = [], None
