"""Missions in flight: which item is flown, and the guidance of each.

Runs of waypoints without a stop between them are planned together: the legs flown forward share their
transitions, and each leg's way of flying is chosen by :mod:`sitl.prediction.mode_choice` unless the mission says.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Way
from protocol.plans.mission import MissionItem
from sitl.autopilot.guidance import MIN_AIRSPEED, FlyTo, Guidance, Ramp, View, distance, land_at
from sitl.autopilot.guidance import Sequence as Steps
from sitl.autopilot.legs import FlyLeg, LandAfter, corner_lead, leg_airspeeds, leg_reference, orbit, over_ground
from sitl.autopilot.mission_items import CIRCLES, LAND, PLACED, TAKEOFF, WAYS, World, height, place, validate
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point, Reference, at, hover_at, upright
from sitl.prediction.chooser import LEGS_AHEAD, Chooser, LegEnd

__all__ = ["MissionRunner", "World", "fly_to", "return_home", "validate"]

SAME_PLACE = 0.5  # take-off and landing points nearer than this are "here" [m]


@dataclass(slots=True)
class MissionRunner:
    """Flies one mission. After ``update``: read ``reached`` and ``notices`` and clear them."""

    items: tuple[MissionItem, ...]
    world: World
    settings: Settings
    chooser: Chooser | None = None  # without one every leg is hovered
    current: int = 0
    finished: bool = False
    reached: list[int] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)
    _guidance: Guidance | None = None
    _reference: Reference | None = None
    _speed: float | None = None
    _airspeed: float | None = None
    _asked: Way = Way.NONE
    _from: Point | None = None  # where the last leg ended, when it was flown through
    _jumps_left: dict[int, int] = field(default_factory=dict)

    def jump_to(self, seq: int) -> None:
        """Make an item the current one; the next update starts it.

        Raises:
            IndexError: If the mission has no such item.
        """
        if not 0 <= seq < len(self.items):
            raise IndexError(f"item {seq} of {len(self.items)}")
        self.current, self.finished = seq, False
        self.interrupt()

    def interrupt(self) -> None:
        """Forget how far the current item was flown: on resuming it starts anew, from wherever it is."""
        self._guidance = self._from = None

    @property
    def landing(self) -> bool:
        """Whether the current item ends on the ground."""
        return self._guidance is not None and self._guidance.landing

    def update(self, view: View) -> Reference:
        """The reference for this tick; moves through as many items as are done."""
        reference = self._reference or hover_at(view.p, view.heading, self.speed)
        for _ in range(2 * len(self.items) + 1):  # bounds a loop of jumps with nothing to fly between
            if self.finished:
                break
            if self._guidance is None:
                self._guidance = self._start(self.items[self.current], view, upright(reference))
            if self._guidance is not None:
                reference = self._guidance.update(view)
                if not self._guidance.done(view):
                    break
            self._advance()
        else:
            self.notices.append("Mission stopped: its jumps loop without a waypoint")
            self.finished = True
        self._reference = reference
        return reference

    def touched_down(self) -> None:
        """The ground ended the current landing."""
        if not self.finished and self.landing:
            self._advance()

    @property
    def speed(self) -> float:
        """Speed limit in force [m/s]."""
        return self.settings.hover_speed if self._speed is None else self._speed

    def _advance(self) -> None:
        item = self.items[self.current]
        self.reached.append(self.current)
        self._guidance = None
        following = self._jump(item) if item.command == mavlink.MAV_CMD_DO_JUMP else self.current + 1
        self.finished = following >= len(self.items)
        if not self.finished:
            self.current = following

    def _jump(self, item: MissionItem) -> int:
        left = self._jumps_left.setdefault(self.current, int(item.params[1]))
        if left == 0:
            return self.current + 1
        if left > 0:
            self._jumps_left[self.current] = left - 1
        return int(item.params[0])

    def _start(self, item: MissionItem, view: View, last: Reference) -> Guidance | None:
        if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED:
            self.change_speed(item.params[1])
            return None
        if item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION:
            self._asked = WAYS[int(item.params[0])]
            return None
        if item.command == mavlink.MAV_CMD_DO_JUMP:
            return None
        return _BUILDERS[item.command](self, item, view, last)

    def change_speed(self, wanted: float) -> None:
        """Speed of the items to come [m/s]: up to its limit that of the hover, from 7 m/s on that of the cruise.

        -1 returns both to the set ones.
        """
        if wanted < 0.0:
            self._speed = self._airspeed = None
        elif wanted >= MIN_AIRSPEED and self.chooser is not None:
            self._airspeed = wanted
        else:
            self._speed = min(wanted, self.settings.hover_speed)
            if wanted > self._speed:
                self.notices.append(f"Speed {wanted:g} m/s: hovering at no more than {self._speed:g} m/s")

    def transition(self, way: Way) -> Way:
        """Fly the items to come this way, until the mission says otherwise; the present one starts anew.

        Returns the way that was asked for until now.
        """
        before, self._asked = self._asked, way
        self._guidance = None
        return before

    @property
    def airspeed(self) -> float:
        """Airspeed of legs in forward flight [m/s]."""
        return self.settings.airspeed if self._airspeed is None else self._airspeed

    def _take_off(self, item: MissionItem, view: View, last: Reference) -> Guidance:
        here = (view.p[0], view.p[1], height(item, self.world))
        climb = Ramp(hover_at(here, _heading(item, last), self.speed), self.settings.climb_rate)
        point = place(item, self.world)
        if point is None or distance(point, here) < SAME_PLACE:
            return climb
        return Steps((climb, FlyTo(at(climb.reference, point), self.settings.acceptance)))

    def _approach(
        self, item: MissionItem, reference: Reference, view: View, acceptance: float, hold: float = 0.0
    ) -> Guidance:
        """The leg to the current item's point, in forward flight if that is the better way."""
        if self.chooser is None:
            return FlyTo(reference, acceptance, hold)
        point = reference.position
        stops = self._chain(point)
        start = self._from if self._from is not None and view.forward else view.p
        decisions = self.chooser.choose(view, start, stops, self.settings, self.airspeed)
        self._from = None
        if decisions[0].way is not Way.FORWARD:
            return FlyTo(reference, acceptance, hold)
        flown = [start]
        for ahead, decision in zip(stops, decisions, strict=True):
            if decision.way is not Way.FORWARD:
                break
            flown.append(ahead.p)
        airspeed = leg_airspeeds(flown, self.airspeed, view.wind)[0] if len(stops) < LEGS_AHEAD else self.airspeed
        stop, lead = len(flown) == 2, 0.0
        if not stop:
            self._from = point
            # A radius in the item means the point itself: it is flown over.
            lead = (
                0.0
                if item.params[1] > 0.0
                else corner_lead(start, point, flown[2], over_ground(start, point, airspeed, view.wind))
            )
        leg = leg_reference(start, point, reference, airspeed, stop=stop)
        asked = math.isfinite(item.params[3])
        return FlyLeg(leg._replace(heading=_heading(item, leg)), acceptance, hold, lead, keep_heading=asked)

    def _chain(self, point: Point) -> list[LegEnd]:
        """The current item's point, and those that follow it without a stop between."""
        stops = [LegEnd(point, self._asked, self.current)]
        asked = self._asked
        for seq in range(self.current, len(self.items)):
            item = self.items[seq]
            if item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION:
                asked = WAYS[int(item.params[0])]
            elif item.command != mavlink.MAV_CMD_DO_CHANGE_SPEED:
                following = place(item, self.world) if item.command in PLACED | LAND else None
                if following is None or len(stops) == LEGS_AHEAD:
                    break
                if seq > self.current:
                    above = max(following[2], stops[-1].p[2]) if item.command in LAND else following[2]
                    stops.append(LegEnd((following[0], following[1], above), asked, seq))
                if item.command != mavlink.MAV_CMD_NAV_WAYPOINT or item.params[0] > 0.0:
                    break
        return stops

    def _waypoint(self, item: MissionItem, view: View, last: Reference) -> Guidance:
        point = place(item, self.world)
        if point is None:
            raise ValueError("a waypoint without a place passed validation")
        reference = hover_at(point, _heading(item, last), self.speed)
        acceptance = self.settings.acceptance
        if item.command == mavlink.MAV_CMD_NAV_WAYPOINT and item.params[1] > 0.0:
            acceptance = item.params[1]
        hold = item.params[0] if math.isfinite(item.params[0]) else 0.0
        if item.command in CIRCLES:
            return self._loiter(item, reference, view, hold)
        return self._approach(item, reference, view, acceptance, hold)

    def _loiter(self, item: MissionItem, reference: Reference, view: View, amount: float) -> Guidance:
        """Wait about a point: in a circle in forward flight if the item gives a radius, else hovering over it."""
        radius = item.params[2] if math.isfinite(item.params[2]) else 0.0
        for_ever = item.command == mavlink.MAV_CMD_NAV_LOITER_UNLIM
        turning = item.command == mavlink.MAV_CMD_NAV_LOITER_TURNS
        if turning and radius == 0.0:
            radius = self.settings.loiter_radius
        chooser = self.chooser
        if radius != 0.0 and chooser is not None and chooser.orbits(reference.position[2], self._asked, self.settings):
            seconds = math.inf if for_ever or turning else amount
            circle = orbit(
                reference.position, radius, reference, self.airspeed, seconds, amount if turning else math.inf
            )
            if circle.reference.path.airspeed >= MIN_AIRSPEED:
                return circle
            self.notices.append(f"A circle of {abs(radius):g} m is too tight to fly: hovering over its centre")
        hold = math.inf if for_ever else 0.0 if turning else amount
        return self._approach(item, reference, view, self.settings.acceptance, hold)

    def _delay(self, item: MissionItem, view: View, last: Reference) -> Guidance:  # noqa: ARG002 - one signature for all builders
        return FlyTo(last, math.inf, item.params[0])

    def _land(self, item: MissionItem, view: View, last: Reference) -> Guidance:
        point = place(item, self.world)
        reference = last._replace(heading=_heading(item, last), speed=self.speed)
        if point is None or math.dist(point[:2], view.p[:2]) < SAME_PLACE:
            return land_at(reference if point is None else at(reference, point), self.settings.descent_rate)
        above = at(reference, (point[0], point[1], max(last.position[2], point[2])))
        approach = self._approach(item, above, view, self.settings.acceptance)
        return Steps((approach, _land_below(approach, above, self.settings)))

    def _return(self, item: MissionItem, view: View, last: Reference) -> Guidance:  # noqa: ARG002 - one signature for all builders
        to = self.world.safe_point(view.p, self.settings.return_altitude)
        return return_home(view, last, self.settings, to, self.chooser, self._asked)


def fly_to(
    view: View, reference: Reference, settings: Settings, chooser: Chooser | None, asked: Way = Way.NONE
) -> FlyTo | FlyLeg:
    """One leg from here to a reference, in forward flight if that is the better way."""
    if chooser is not None:
        decision = chooser.choose(view, view.p, [LegEnd(reference.position, asked)], settings, settings.airspeed)[0]
        if decision.way is Way.FORWARD:
            leg = leg_reference(view.p, reference.position, reference, settings.airspeed, stop=True)
            return FlyLeg(leg, settings.acceptance)
    return FlyTo(reference, settings.acceptance)


def return_home(
    view: View,
    last: Reference,
    settings: Settings,
    to: Point,
    chooser: Chooser | None = None,
    asked: Way = Way.NONE,
) -> Steps:
    """Climb to the height of a point, world NWU [m], or stay higher, fly there and land below it."""
    high = max(view.p[2], to[2])
    here = hover_at((view.p[0], view.p[1], high), last.heading, settings.hover_speed)
    above_home = at(here, (to[0], to[1], high))
    climbed = view if view.forward else view._replace(p=here.position)
    home = fly_to(climbed, above_home, settings, chooser, asked)
    down = _land_below(home, above_home, settings)
    return Steps((home, down) if view.forward else (Ramp(here, settings.climb_rate), home, down))


def _land_below(approach: Guidance, above: Reference, settings: Settings) -> Guidance:
    if isinstance(approach, FlyLeg):
        return LandAfter(approach, settings.descent_rate)
    return land_at(above, settings.descent_rate)


def _heading(item: MissionItem, last: Reference) -> float:
    """The item's yaw (degrees clockwise from north) as a heading, or the last one where it is NaN."""
    yaw = item.params[3]
    return -math.radians(yaw) if math.isfinite(yaw) else last.heading


_Builder = Callable[[MissionRunner, MissionItem, View, Reference], Guidance]
_BUILDERS: dict[int, _Builder] = {
    **dict.fromkeys(TAKEOFF, MissionRunner._take_off),  # noqa: SLF001 - the table is part of the class
    **dict.fromkeys(LAND, MissionRunner._land),  # noqa: SLF001
    **dict.fromkeys(PLACED, MissionRunner._waypoint),  # noqa: SLF001
    mavlink.MAV_CMD_NAV_DELAY: MissionRunner._delay,  # noqa: SLF001
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: MissionRunner._return,  # noqa: SLF001
}
