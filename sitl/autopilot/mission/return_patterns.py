"""The landings that a mission has for returns: from a DO_LAND_START on to the next landing.

https://docs.px4.io/main/en/flight_modes_vtol/return.html: RTL_TYPE says whether a return flies one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from protocol.dialect import mavlink
from protocol.plans.plan import MissionItem
from sitl.autopilot.mission.items import CLIMB_COMMANDS, LAND_COMMANDS, POSITION_COMMANDS
from sitl.autopilot.mission.places import position_of
from sitl.autopilot.safety.world import World
from sitl.autopilot.settings import RETURN_TO_LANDING, RETURN_TO_NEAREST, Settings
from sitl.control.reference import Point, Reference
from sitl.guidance.view import VehicleView


class LandingPattern(NamedTuple):
    """One of them."""

    start: int  # number of its DO_LAND_START
    end: int  # of the landing
    points: tuple[Point, ...]  # on the way to the landing, and above it; world NWU [m]


def return_pattern(items: Sequence[MissionItem], world: World, settings: Settings, p: Point) -> LandingPattern | None:
    """The landing that a return from a point, world NWU [m], flies; None if it goes home or to a rally point."""
    if settings.return_type not in {RETURN_TO_LANDING, RETURN_TO_NEAREST}:
        return None
    nearest = min(_patterns(items, world), key=lambda pattern: math.dist(pattern.points[0][:2], p[:2]), default=None)
    if nearest is None or settings.return_type == RETURN_TO_LANDING:
        return nearest
    is_nearest = math.dist(nearest.points[0][:2], p[:2]) < math.dist(world.safe_point(p)[:2], p[:2])
    return nearest if is_nearest else None


def _patterns(items: Sequence[MissionItem], world: World) -> Iterator[LandingPattern]:
    for start, item in enumerate(items):
        if item.command == mavlink.MAV_CMD_DO_LAND_START:
            pattern = _pattern(items, start, world)
            if pattern is not None:
                yield pattern


def _pattern(items: Sequence[MissionItem], start: int, world: World) -> LandingPattern | None:
    points: list[Point] = []
    for seq in range(start + 1, len(items)):
        item = items[seq]
        if item.command in LAND_COMMANDS | POSITION_COMMANDS and (point := position_of(item, world)) is not None:
            lands = item.command in LAND_COMMANDS
            points.append(point if not lands or not points else (point[0], point[1], max(point[2], points[-1][2])))
        if item.command in CLIMB_COMMANDS and points:
            points += _turn_about(points[-1], item.params[1])
        if item.command in LAND_COMMANDS and points:
            return LandingPattern(start, seq, tuple(points))
    return None


def _turn_about(centre: Point, radius: float) -> list[Point]:
    """Points on a way about as long as a turn of a circle: it takes energy, whatever its radius turns out to be."""
    r = 0.0 if math.isnan(radius) else abs(radius)
    return [(centre[0] + north, centre[1], centre[2]) for north in (r, -r, r)] if r > 0.0 else []


class PatternRunner(Protocol):
    """A runner of mission items."""

    notices: list[str]

    @property
    def landing(self) -> bool:
        """Whether the current item ends on the ground."""

    def update(self, view: VehicleView) -> Reference:
        """The reference for this tick."""


@dataclass(slots=True)
class FlyPattern:
    """Fly a landing of a mission: the ground ends it."""

    runner: PatternRunner  # of the mission, with the start of the landing as its current item
    say: Callable[[str], None]

    @property
    def landing(self) -> bool:
        """Whether touching the ground ends it: at its last item."""
        return self.runner.landing

    def update(self, view: VehicleView) -> Reference:
        """The reference for this tick."""
        reference = self.runner.update(view)
        for text in self.runner.notices:
            self.say(text)
        self.runner.notices.clear()
        return reference

    def done(self, view: VehicleView) -> bool:  # noqa: ARG002 - the ground ends it
        """Never."""
        return False
