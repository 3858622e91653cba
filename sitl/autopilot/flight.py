"""One flight as the autopilot knows it: the state that all its requests share, and what they are made of."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.modes import Mode
from sitl.autopilot.failsafe import Failsafes
from sitl.autopilot.fence import Fence
from sitl.autopilot.guidance import Guidance, Hold, Stop, View, land_at
from sitl.autopilot.guidance import Sequence as Steps
from sitl.autopilot.mission import MissionRunner, World
from sitl.autopilot.outcome import FAILED, Notice, Outcome
from sitl.autopilot.progress import Transition
from sitl.autopilot.settings import Settings
from sitl.autopilot.streamed import FLOOR, Streamed
from sitl.control.reference import Point, Reference, hover_at
from sitl.prediction.chooser import Chooser

ARM_WITHIN = 20.0  # of a take-off or a mission that was chosen before [s]
COMPASS = tuple((math.cos(k * math.pi / 4.0), math.sin(k * math.pi / 4.0)) for k in range(8))


class Awaiting(NamedTuple):
    """What arming begins: QGroundControl chooses take-off or mission first and arms then, as PX4 wants it."""

    begin: Callable[[], Outcome]
    until: float  # [s] of the vehicle's time


class Flight:
    """Mode, arming state, mission and reference. The requests of each kind are the subclasses'."""

    def __init__(self, world: World, settings: Settings, heading: float = 0.0, chooser: Chooser | None = None) -> None:
        self.world = world
        self.settings = settings
        self.chooser = chooser  # of the way to fly a leg; without one the vehicle hovers
        self.mode = Mode.HOLD
        self.armed = False
        self.flying = False  # asked to be in the air: the supervisor leaves the ground on this
        self.mission: MissionRunner | None = None
        self.view = View(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), heading, 0.0, True, 1.0)
        self.reference = hover_at((0.0, 0.0, 0.0), heading, settings.hover_speed)
        self._guidance: Guidance | None = None
        self.under_way: Transition | None = None  # asked for by command, and not ended
        self._streamed = Streamed(self.reference)
        self._awaiting: Awaiting | None = None
        self._landed_at: float | None = None
        self._notices: list[Notice] = []
        self._reached: list[int] = []
        self.failsafes = Failsafes()
        self._fence = Fence()  # as it was loaded, in force or not
        self._bound()

    def notices(self) -> list[Notice]:
        """Lines for the pilot since the last call."""
        said, self._notices = self._notices, []
        return said

    def say(self, severity: int, text: str) -> None:
        """Queue a line for the pilot."""
        self._notices.append(Notice(severity, text))

    def _bound(self) -> None:
        """Put fence, rally points and home in force, for a mission under way as well."""
        s = self.settings
        bounds = self._fence._replace(reach=s.fence_reach, ceiling=s.fence_ceiling, home=self.world.home)
        self.world = self.world._replace(fence=bounds if s.fence_action else Fence())
        if self.mission is not None:
            self.mission.world = self.world

    def _refuse(self, result: int, text: str) -> Outcome:
        self.say(mavlink.MAV_SEVERITY_WARNING, text)
        return Outcome(result, text)

    def _refuse_point(self, p: Point) -> str | None:
        if not all(map(math.isfinite, p)):
            return f"position {p} is not a number"
        return self.world.refuse(p)

    def _refuse_rim(self, centre: Point, radius: float) -> str | None:
        rim = [(centre[0] + radius * x, centre[1] + radius * y, centre[2]) for x, y in COMPASS]
        return next(filter(None, map(self._refuse_point, rim)), None)

    def _enter(self, mode: Mode, guidance: Guidance | None) -> None:
        self._awaiting = None
        superseded = self.under_way
        if superseded is not None:
            superseded.fail(f"{mode.name} came between" if self.flying else "the flight is over")
            self._end(superseded)
            if self.mode is Mode.MISSION and self.mission is not None:
                self.mission.transition(superseded.before)
        self.mode, self._guidance = mode, guidance

    def _end(self, transition: Transition) -> None:
        self.under_way = None
        if transition.end is not None and transition.end.text:
            failed = transition.end.result == FAILED
            self.say(mavlink.MAV_SEVERITY_WARNING if failed else mavlink.MAV_SEVERITY_INFO, transition.end.text)

    def _at(self, p: Point) -> Reference:
        return hover_at(p, self.reference.heading, self.settings.hover_speed)

    def _stop_point(self) -> Point:
        # Where the vehicle can stop, not where it is now, and no lower than the floor.
        p, v = self.view.p, self.view.v
        level = math.hypot(v[0], v[1])
        ahead = self.view.stopping / level if self.view.forward and level > 1.0 else 0.5
        return (p[0] + ahead * v[0], p[1] + ahead * v[1], max(p[2] + 0.5 * v[2], FLOOR))

    def _land_here(self) -> None:
        here = self._at(self._stop_point())
        first = (Stop(here),) if self.view.forward else ()  # a reference that sinks meanwhile would run away
        self._enter(Mode.LAND, Steps((*first, land_at(here, self.settings.descent_rate))))

    def _hold_here(self) -> None:
        self._enter(Mode.HOLD, Hold(self._at(self._stop_point())) if self.flying else None)
