"""Missions in flight: which item is current, and the manoeuvre of each.

Runs of waypoints without a stop between them are planned together: the legs flown forward share their transitions.
Whether a leg is hovered or flown forward is decided by :mod:`sitl.prediction.mode_choice` unless the mission says so.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.plans.item_circles import CLIMB_COMMANDS
from protocol.plans.plan import MissionItem, Refusal
from sitl.autopilot.leg_planner import Arrival, ChainAhead, LegPlanner, land_after, no_descent, stopping_point
from sitl.autopilot.mission.items import (
    CONDITION_COMMANDS,
    LAND_COMMANDS,
    ORDER_COMMANDS,
    POSITION_COMMANDS,
    TAKEOFF_COMMANDS,
    WAY_OF_VTOL_STATE,
    AwaitCondition,
    Condition,
    Order,
    WaitingItems,
    height_of,
    next_flown,
    order_of,
    position_of,
)
from sitl.autopilot.mission.mission_legs import Circling, chain_from, hold_time, hovered
from sitl.autopilot.mission.speeds import MissionSpeeds
from sitl.autopilot.settings import RETURN_TO_LANDING, RETURN_TO_NEAREST, Settings
from sitl.autopilot.world import World
from sitl.control.reference import LEG, Path, Point, Reference, at, hover_at, leg, upright
from sitl.enclosure.arena_detours import crossed
from sitl.guidance.headings import YawTurn
from sitl.guidance.landing import LandingDescent
from sitl.guidance.leg_speeds import corner_lead, speed_along
from sitl.guidance.legs import FlyLeg, stretches_of
from sitl.guidance.manoeuvre_changes import change_airspeed, change_hover_speed, change_vertical_speeds
from sitl.guidance.manoeuvres import FlyTo, Hold, Manoeuvre, ManoeuvreSequence, Ramp, StayOnGround, distance
from sitl.guidance.view import MIN_HOLD_HEIGHT, VehicleView
from sitl.guidance.way_ahead import WayStretch
from sitl.prediction.chooser import Chooser

# Items of a mission that are done, told in their order.


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


# The landings that a mission has for returns: from a DO_LAND_START on to the next landing.
#
# https://docs.px4.io/main/en/flight_modes_vtol/return.html: RTL_TYPE says whether a return flies one.


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


@dataclass(slots=True)
class FlyPattern:
    """Fly a landing of a mission: the ground ends it."""

    runner: MissionRunner  # of the mission, with the start of the landing as its current item
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


SAME_PLACE = 0.5  # take-off and landing points nearer than this are where the vehicle is [m]


@dataclass(slots=True)
class MissionRunner:
    """Flies one mission. After ``update``: read ``reached`` and ``notices`` and clear them."""

    items: tuple[MissionItem, ...]
    world: World
    settings: Settings
    chooser: Chooser | None = None  # None: every leg is hovered
    carry_out: Callable[[Order], object] = lambda _order: None  # what items ask of other parts of the vehicle
    current: int = 0
    finished: bool = False
    begun: bool = False  # since it was loaded, restarted or led to its present item, it has been flown
    paused: bool = False  # after an item whose autocontinue is off
    passed: PassedItems = field(default_factory=PassedItems)
    notices: list[str] = field(default_factory=list)
    turn: YawTurn | None = None  # of the heading, while the current item is flown
    _manoeuvre: Manoeuvre | None = None
    _held: int | None = None  # the current item, once its hold has begun
    _reference: Reference | None = None
    _speeds: MissionSpeeds = field(default_factory=MissionSpeeds)
    _changed_speeds: bool = False  # since the present manoeuvre took them
    _requested: LegMode = LegMode.NONE  # of the items to come
    _from: Point | None = None  # where the last leg ended, if it did not stop there
    _ahead: ChainAhead = field(default_factory=ChainAhead)  # the leg under way and those flown forward after it
    _aground: bool = False  # it stood on the ground, and no item has led it up since
    _jumps_left: dict[int, int] = field(default_factory=dict)
    _waiting: WaitingItems = field(default_factory=WaitingItems)  # while the current item is flown

    def restart(self, seq: int = 0) -> None:
        """Begin as after an upload, with an item: counters of jumps, speeds and ways of flying are forgotten.

        Raises:
            IndexError: If the mission has no such item.
        """
        self.jump_to(seq)
        self.reset()

    def reset(self) -> None:
        """Forget counters of jumps, speeds and ways of flying; the current item goes on, or is open again."""
        self.finished = False
        self._jumps_left.clear()
        self._requested = LegMode.NONE
        self._speeds, self._changed_speeds = MissionSpeeds(), self._manoeuvre is not None

    def jump_to(self, seq: int) -> None:
        """Make an item the current one; the next update starts it.

        Raises:
            IndexError: If the mission has no such item.
        """
        if not 0 <= seq < len(self.items):
            raise IndexError(f"item {seq} of {len(self.items)}")
        self.current, self.finished, self.begun = seq, False, False
        self.turn, self._waiting, self._held = None, WaitingItems(), None
        self.interrupt()

    def interrupt(self) -> None:
        """Forget how far the current item was flown: when resumed it starts anew, from wherever the vehicle is."""
        self._manoeuvre = self._from = None
        self.paused = False
        self.passed.end_turn()

    def revise(self, items: tuple[MissionItem, ...]) -> None:
        """Fly other items from now on, as many; what is over stays so, and the current item starts anew if it is.

        Args:
            items: All of the mission's.
        """
        is_changed = items[self.current :] != self.items[self.current :]  # the legs ahead are planned together
        self._jumps_left = {seq: left for seq, left in self._jumps_left.items() if items[seq] == self.items[seq]}
        self.items = items
        if is_changed:
            self.interrupt()

    @property
    def reached(self) -> list[int]:
        """Items that were reached, to be read and cleared."""
        return self.passed.told

    @property
    def manoeuvre(self) -> Manoeuvre | None:
        """Of the current item; None between items."""
        return self._manoeuvre

    @property
    def landing(self) -> bool:
        """Whether the current item ends on the ground."""
        return self._manoeuvre is not None and self._manoeuvre.landing

    def update(self, view: VehicleView) -> Reference:
        """The reference for this tick; moves through as many items as are done."""
        reference = self._reference or hover_at(view.p, view.heading, self.speed)
        self.begun = True
        self._aground |= view.landed
        self.passed.update(view.p)
        if self._changed_speeds:
            self._apply_speeds(view)
        for _ in range(2 * len(self.items) + 1):  # bounds a loop of jumps with nothing to fly between
            if self.finished:
                break
            if self._manoeuvre is None:
                self._ahead = ChainAhead()
                self._manoeuvre = self._start(self.items[self.current], view, upright(reference))
                change_vertical_speeds(self._manoeuvre, self._speeds.climb, self._speeds.descent)
            if self._waiting.seqs:
                self._carry_out_waiting(view, upright(reference))
            if self._manoeuvre is not None:
                reference = self._manoeuvre.update(view)
                if not self._manoeuvre.done(view):
                    self._tell_arrival()
                    break
            self._advance(view)
            if self.paused:
                break
        else:
            self.notices.append("Mission stopped: jumps loop without a waypoint")
            self.finished = True
        self._reference = reference
        return reference

    def _tell_arrival(self) -> None:
        """Tell an item that is held as reached where its hold begins (MISSION_ITEM_REACHED), once."""
        flown = self._manoeuvre
        is_held = isinstance(flown, FlyTo | FlyLeg) and flown.arrived is not None and flown.acceptance < math.inf
        if is_held and self._held != self.current:
            self._held = self.current
            self.passed.add(self.current)

    def touched_down(self) -> None:
        """The ground ended the current landing."""
        if not self.finished and self.landing:
            self._advance(None)

    def stretches_ahead(self, path: Path) -> tuple[WayStretch, ...]:
        """The leg under way, whose path is given, and those planned after it; or the circle."""
        first, points = stretches_of(self._manoeuvre, path), self._ahead.points
        return (*first, *self._after(points)) if len(first) == 1 and path.kind == LEG and len(points) > 2 else first

    def _after(self, points: Sequence[Point]) -> Iterator[WayStretch]:
        """The legs after the first one through points."""
        for number, (start, end) in enumerate(itertools.pairwise(points[1:]), 2):
            is_last = number + 1 == len(points)
            lead = 0.0
            if not is_last:
                radius = self._radius_of(self._ahead.seqs[number - 1])
                lead = radius or corner_lead(start, end, points[number + 1], self.airspeed)
            stops = is_last and not self._ahead.is_long
            yield WayStretch(leg(start, end, self.airspeed, stop=stops), lead)

    def _radius_of(self, seq: int) -> float:
        """Radius within which an item is passed [m]; 0: as the turn needs it."""
        item = self.items[seq] if seq < len(self.items) else None
        is_waypoint = item is not None and item.command == mavlink.MAV_CMD_NAV_WAYPOINT
        return item.params[1] if item is not None and is_waypoint and item.params[1] > 0.0 else 0.0

    @property
    def speed(self) -> float:
        """Speed limit of the hover in force [m/s]."""
        wanted, limit = self._speeds.hover, self.settings.hover_speed
        return limit if wanted is None else min(wanted, limit)

    @property
    def airspeed(self) -> float:
        """Airspeed of legs in forward flight [m/s]."""
        return self._speeds.airspeed(self.settings)

    @property
    def _planner(self) -> LegPlanner:
        return LegPlanner(
            settings=self.settings,
            chooser=self.chooser,
            arena=self.world.arena,
            speeds=self._speeds,
            requested=self._requested,
        )

    def configure(self, settings: Settings) -> None:
        """Take changed settings: speeds that the mission left to them act at once, the rest from the next item on."""
        before, self.settings = self.settings, settings
        if (before.hover_speed, before.airspeed) != (settings.hover_speed, settings.airspeed):
            self._changed_speeds = True

    def change_speed(self, kind: float, speed: float) -> None:
        """Change a speed of the leg under way and of the items to come.

        Args:
            kind: SPEED_TYPE.
            speed: [m/s]; -1 changes nothing, -2 takes that of the settings.
        """
        flies = self.chooser is not None and self.chooser.can_fly_forward
        self.notices += filter(None, [self._speeds.change(kind, speed, self.settings, can_fly_forward=flies)])
        self._changed_speeds = self._manoeuvre is not None

    def _apply_speeds(self, view: VehicleView) -> None:
        """Go on with the manoeuvre under way at the speeds in force."""
        self._changed_speeds = False
        if self.world.arena.obstacles and view.forward:
            self._manoeuvre = None  # the way past them depends on the speed
            return
        change_hover_speed(self._manoeuvre, self.speed)
        airspeed = self._planner.airspeeds(self._ahead, view.wind)[0] if self._ahead.points else self.airspeed
        change_airspeed(self._manoeuvre, airspeed)
        if isinstance(self._manoeuvre, FlyLeg) and self._manoeuvre.lead > 0.0:
            start, corner, after = self._ahead.points[:3]
            self._manoeuvre.lead = corner_lead(start, corner, after, speed_along(start, corner, airspeed, view.wind))
        change_vertical_speeds(self._manoeuvre, self._speeds.climb, self._speeds.descent)

    def request(self, mode: LegMode) -> LegMode:
        """Hover or fly the items to come until the mission says otherwise; the present one starts anew.

        Returns what was requested until now.
        """
        before, self._requested = self._requested, mode
        self._manoeuvre = None
        return before

    def _advance(self, view: VehicleView | None) -> None:
        item = self.items[self.current]
        if view is not None and isinstance(self._manoeuvre, FlyLeg) and self._manoeuvre.lead > 0.0:
            self.passed.begin_turn(self._manoeuvre.reference.position, view.p)
        if self._held != self.current:
            self.passed.add(self.current)
        self._manoeuvre, self.turn, self._held = None, None, None
        self._aground &= item.command not in TAKEOFF_COMMANDS | POSITION_COMMANDS
        if self._waiting.seqs:
            self.notices.append(f"Passed over, its condition was not met: {self._waiting.words}")
            self._waiting = WaitingItems()
        following = self._jump(item) if item.command == mavlink.MAV_CMD_DO_JUMP else self.current + 1
        self.finished = following >= len(self.items)
        if not self.finished:
            self.paused = not item.autocontinue
            if self.paused:
                self.notices.append(f"Mission paused after item {self.current}: continue to go on")
            self.current = following

    def _jump(self, item: MissionItem) -> int:
        """Number of the item after a DO_JUMP, whose repeats are counted."""
        left = self._jumps_left.setdefault(self.current, int(item.params[1]))
        if left == 0:
            return self.current + 1
        if left > 0:
            self._jumps_left[self.current] = left - 1
        return int(item.params[0])

    def _start(self, item: MissionItem, view: VehicleView, last: Reference) -> Manoeuvre | None:
        """Begin an item: its manoeuvre, or None if it is done at once."""
        if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED:
            self.change_speed(*item.params[:2])
            return None
        if item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION:
            self._requested = WAY_OF_VTOL_STATE[int(item.params[0])]
            return None
        if item.command in ORDER_COMMANDS:
            self.carry_out(order_of(self.current, item, self.world))
        if item.command in ORDER_COMMANDS | {mavlink.MAV_CMD_DO_JUMP, mavlink.MAV_CMD_DO_LAND_START}:
            return None
        if item.command in CONDITION_COMMANDS:
            return self._wait(item, view, last)
        is_up = not self._aground or view.forward
        if item.command in TAKEOFF_COMMANDS and (is_up or view.p[2] > height_of(item, self.world)):
            self.notices.append(f"Take-off of item {self.current} passed over: already in the air")
            return None
        return self._manoeuvre_of(item, view, last)

    def _wait(self, item: MissionItem, view: VehicleView, last: Reference) -> Manoeuvre | None:
        """Let the items from here to the next one that is flown wait, and begin that; without one, wait here."""
        flown = next_flown(self.items, self.current)
        if flown is None:
            return AwaitCondition(last, Condition.of(item, view))
        self._waiting, self.current = WaitingItems(list(range(self.current, flown))), flown
        return self._start(self.items[flown], view, last)

    def _carry_out_waiting(self, view: VehicleView, last: Reference) -> None:
        """Carry out the items that wait no more."""
        flown, end = self.current, position_of(self.items[self.current], self.world)
        while (seq := self._waiting.next_free(self.items, view, end)) is not None:
            self.current = seq
            if self.items[seq].command not in CONDITION_COMMANDS:
                self._start(self.items[seq], view, last)
            self.passed.add(seq)
        self.current, self.turn = flown, self._waiting.turn or self.turn

    def _manoeuvre_of(self, item: MissionItem, view: VehicleView, last: Reference) -> Manoeuvre:
        if item.command in TAKEOFF_COMMANDS:
            return self._take_off(item, view, last)
        if item.command in LAND_COMMANDS:
            return self._land(item, view, last)
        if item.command == mavlink.MAV_CMD_NAV_DELAY:
            return StayOnGround(last, item.params[0]) if view.landed else FlyTo(last, math.inf, item.params[0])
        if item.command == mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            pattern = return_pattern(self.items, self.world, self.settings, view.p)
            if pattern is not None and not pattern.start < self.current <= pattern.end:
                again = MissionRunner(
                    self.items, self.world, self.settings, self.chooser, self.carry_out, pattern.start
                )
                return FlyPattern(again, self.notices.append)
            to = self.world.safe_point(view.p, self.settings.return_altitude)
            planner = self._planner._replace(speeds=MissionSpeeds())
            route = planner.return_to(view, last, self.world.arena.clamped(to))
            return self._stopped(route.text, last) if isinstance(route, Refusal) else route
        return self._go_to(item, view, last)

    def _take_off(self, item: MissionItem, view: VehicleView, last: Reference) -> Manoeuvre:
        here = (view.p[0], view.p[1], height_of(item, self.world))
        climb = Ramp(hover_at(here, _heading(item, last), self.speed), self._speeds.climb or self.settings.climb_rate)
        if above := crossed(self.world.arena, view.p, here, self.settings.clearance):
            return self._stopped(f"'{above[0].name}' is above", last)
        point = position_of(item, self.world)
        if point is None or distance(point, here) < SAME_PLACE:
            return climb
        # It goes on hovering, whatever the way.
        hovering = self._planner._replace(chooser=None)
        leg = hovering.leg_to(view._replace(p=here), at(climb.reference, point))
        return self._stopped(leg.text, last) if isinstance(leg, Refusal) else ManoeuvreSequence((climb, leg))

    def _land(self, item: MissionItem, view: VehicleView, last: Reference) -> Manoeuvre:
        point = position_of(item, self.world)
        reference = last._replace(heading=_heading(item, last), speed=self.speed)
        to = stopping_point(view) if point is None else point
        above = at(reference, (to[0], to[1], max(view.p[2], to[2], MIN_HOLD_HEIGHT)))
        if reason := no_descent(self.world.arena, above.position, self.settings.clearance):
            return self._stopped(reason, last)
        if point is None or math.dist(to[:2], view.p[:2]) < SAME_PLACE:
            return LandingDescent(above, self.settings.descent_rate, anywhere=point is None)
        approach = self._approach(item, above, view)
        return approach if self.finished else ManoeuvreSequence((approach, land_after(approach, above, self.settings)))

    def _go_to(self, item: MissionItem, view: VehicleView, last: Reference) -> Manoeuvre:
        point = position_of(item, self.world)
        if point is None:
            raise ValueError("a waypoint without a position passed validation")
        item = hovered(item)
        if point[2] < MIN_HOLD_HEIGHT:
            self.notices.append(f"Item {self.current} at {point[2]:g} m is flown at {MIN_HOLD_HEIGHT:g} m")
        reference = hover_at((*point[:2], max(point[2], MIN_HOLD_HEIGHT)), _heading(item, last), self.speed)
        about = Circling(view, self.world, self.settings, self.chooser, self._requested, self.airspeed, self.notices)
        circle = about.circle_of(self.items, self.current, reference)
        radius = self._radius_of(self.current)
        return circle or self._approach(item, reference, view, radius, hold_time(item))

    def _approach(
        self, item: MissionItem, reference: Reference, view: VehicleView, radius: float = 0.0, hold: float = 0.0
    ) -> Manoeuvre:
        """The way to the current item's point, in forward flight if that is better."""
        arrival = Arrival(radius, hold, turns=math.isfinite(item.params[3]))
        ends = chain_from(self.items, self.current, reference.position, self._requested, self.world)
        start = self._from if view.forward else None
        planned = self._planner.plan(view, reference, ends, arrival, start)
        self._from = None
        if isinstance(planned, Refusal):
            return self._stopped(planned.text, reference)
        self._ahead = planned.chain
        if len(self._ahead.points) > 2:
            self._from = reference.position
        return planned.manoeuvre

    def _stopped(self, reason: str, last: Reference) -> Manoeuvre:
        """End the mission where there is no way on."""
        self.notices.append(f"Mission stopped at item {self.current}: {reason}")
        self.finished = True
        return Hold(last)


def _heading(item: MissionItem, last: Reference) -> float:
    """The item's yaw (degrees clockwise from north) as a heading, or the last one where it is NaN."""
    yaw = item.params[3]
    return -math.radians(yaw) if math.isfinite(yaw) else last.heading
