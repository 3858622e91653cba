"""Items of a mission that are done, told in their order."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from sitl.control.reference import Point


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
