"""A mission as a list of items that is edited, and its legs: ends, how each is flown, which follow without a stop.

Jumps are not followed: every item is flown once, in its order.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from darko_gcs.state.mission_items import place_of
from darko_gcs.state.return_goal import LANDINGS, return_goal
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import Items, LegChain, LegPrediction
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.frames import Vector
from protocol.plans import MissionItem
from protocol.plans.item_circles import item_radius
from protocol.ranges import LEGS_AHEAD, MIN_AIRSPEED

TRANSITION = mavlink.MAV_CMD_DO_VTOL_TRANSITION
WAY_STATES = {
    LegMode.NONE: mavlink.MAV_VTOL_STATE_UNDEFINED,
    LegMode.HOVER: mavlink.MAV_VTOL_STATE_MC,
    LegMode.FORWARD: mavlink.MAV_VTOL_STATE_FW,
}  # param1 of DO_VTOL_TRANSITION; undefined leaves the choice to the vehicle again
LEG_MODE_OF_STATE = {float(state): leg_mode for leg_mode, state in WAY_STATES.items()}
LEG_ENDS = frozenset(
    {
        mavlink.MAV_CMD_NAV_WAYPOINT,
        mavlink.MAV_CMD_NAV_LOITER_TIME,
        mavlink.MAV_CMD_NAV_LOITER_TURNS,
        mavlink.MAV_CMD_NAV_LOITER_UNLIM,
        mavlink.MAV_CMD_NAV_LOITER_TO_ALT,
        mavlink.MAV_CMD_NAV_LAND,
        mavlink.MAV_CMD_NAV_VTOL_LAND,
        mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,
    }
)  # commands to which a leg leads that may be flown either way


def replaced(items: Items, row: int, item: MissionItem) -> Items:
    """Another item in the place of one."""
    return (*items[:row], item, *items[row + 1 :])


def inserted(items: Items, row: int, new: Sequence[MissionItem]) -> Items:
    """New items before the one of a row; at the end if there is none."""
    return _renumbered([*enumerate(items[:row]), *((None, item) for item in new), *enumerate(items[row:], row)])


def removed(items: Items, row: int) -> Items:
    """Without the item of a row; jumps to it lead to the next one."""
    return _renumbered([(seq, item) for seq, item in enumerate(items) if seq != row])


def moved(items: Items, row: int, to: int) -> Items:
    """The item of a row in another one."""
    rest = [(seq, item) for seq, item in enumerate(items) if seq != row]
    return _renumbered([*rest[:to], (row, items[row]), *rest[to:]])


def asked_leg_modes(items: Items) -> tuple[LegMode, ...]:
    """Flight state (hover or forward) that the plan asks for on the leg to each item."""
    modes, leg_mode = [], LegMode.NONE
    for item in items:
        if item.command == TRANSITION:
            leg_mode = LEG_MODE_OF_STATE.get(item.params[0], leg_mode)
        modes.append(leg_mode)
    return tuple(modes)


def with_leg_mode(items: Items, row: int, leg_mode: LegMode) -> tuple[Items, int]:
    """The mission with another leg mode for the leg to one item; the other legs keep theirs.

    Transition items are put in and taken out as needed.

    Returns:
        The items, and the row of the item now.
    """
    modes = list(asked_leg_modes(items))
    modes[row] = leg_mode
    kept: list[tuple[int | None, MissionItem]] = []
    present, new_row = LegMode.NONE, row
    for seq, item in enumerate(items):
        if item.command == TRANSITION and item.params[0] in LEG_MODE_OF_STATE:
            continue
        if item.command in LEG_ENDS and modes[seq] != present:
            present = modes[seq]
            kept.append((_transition_before(items, seq), _transition(present)))
        if seq == row:
            new_row = len(kept)
        kept.append((seq, item))
    return _renumbered(kept), new_row


def _transition_before(items: Items, seq: int) -> int | None:
    """Number of a transition directly before an item, to which jumps may lead."""
    return seq - 1 if seq and items[seq - 1].command == TRANSITION else None


def _transition(leg_mode: LegMode) -> MissionItem:
    params = (float(WAY_STATES[leg_mode]), 0.0, 0.0, 0.0)
    return MissionItem(command=TRANSITION, frame=mavlink.MAV_FRAME_MISSION, params=params, x=0, y=0, z=0.0)


def _renumbered(kept: Sequence[tuple[int | None, MissionItem]]) -> Items:
    """The items with their jumps to the new numbers; each comes with its old number, None for a new one."""
    old = [seq for seq, _ in kept if seq is not None]
    number = {seq: place for place, (seq, _) in enumerate(kept) if seq is not None}

    def led(item: MissionItem) -> MissionItem:
        if item.command != mavlink.MAV_CMD_DO_JUMP or not item.params[0] >= 0.0:
            return item
        target = next((number[seq] for seq in sorted(old) if seq >= item.params[0]), None)
        return item if target is None else replace(item, params=(float(target), *item.params[1:]))

    return tuple(item if seq is None else led(item) for seq, item in kept)


LOW_LEG = 10.0  # height below which a leg flown forward is worth a warning: it sinks by some metres in a turn [m]
LOW_WARNING = "LOW: "
LOITER_RADIUS = "NAV_LOITER_RAD"  # parameter of the vehicle: radius of circles that leave it open [m]
LONG_LEG = 40.0  # that a vehicle without another word flies forward [m]
SHORTEST_COURSE = 1.0  # of a leg that has a course [m]
LEAVES_METRE = 0.75  # farther from whole metres than this, a place is nearer to others [m]
TAKE_OFFS = frozenset({mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_TAKEOFF})
FLOWN_MISSION = frozenset({mavlink.MISSION_STATE_ACTIVE, mavlink.MISSION_STATE_PAUSED})


@dataclass(frozen=True, kw_only=True)
class MissionLeg:
    """The leg to one item."""

    seq: int
    start: Vector  # NED in the vehicle's local frame [m]
    end: Vector  # of a landing above its place, at the height of before: the descent is no leg
    asked: LegMode
    stops: bool  # whether the vehicle waits or lands at its end
    is_take_off: bool = False  # always hovered, and no leg that the vehicle predicts
    is_return: bool = False  # planned by itself, from a stop
    hover_speed: float | None = None  # [m/s]; None: the vehicle's own
    airspeed: float | None = None  # [m/s]; None: the vehicle's own
    goal: str = ""  # of a return that does not lead home: "rally 0"
    circle: float = 0.0  # radius of the circle that is flown about its end [m]; 0: none

    @property
    def distance(self) -> float:
        """Level length [m]."""
        return math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def climb(self) -> float:
        """Height gained [m]."""
        return self.start[2] - self.end[2]


def mission_legs(items: Items, s: Snapshot, begins_at: Vector | None = None) -> tuple[MissionLeg, ...]:
    """The legs of a mission; empty until home is known.

    Args:
        items: The mission.
        s: What is known of the vehicle.
        begins_at: Where the mission that is flown began; see ``beginning``.
    """
    if s.position.home is None:
        return ()
    is_flown = s.mission.state in FLOWN_MISSION
    here = (begins_at or s.position.home_p) if is_flown else beginning(s)
    passed_over = TAKE_OFFS if s.status.is_airborne and not is_flown else frozenset()
    legs: list[MissionLeg] = []
    hover_speed, airspeed, default_radius = None, None, s.parameters.values.get(LOITER_RADIUS, 0.0)
    for seq, (item, leg_mode) in enumerate(zip(items, asked_leg_modes(items), strict=True)):
        if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED:
            hover_speed, airspeed = _changed(item.params[1], hover_speed, airspeed)
        elif item.command in (TAKE_OFFS | LEG_ENDS) - passed_over:
            returns = item.command == mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH
            goal = return_goal(items, seq, here, s) if returns else None
            place = place_of(item, s.position.home, s.position.home_p) if goal is None else goal.place
            if place is None and item.command not in TAKE_OFFS | LANDINGS:
                continue
            end = _end(item.command, here, place, item.z)
            hold = item.command != mavlink.MAV_CMD_NAV_WAYPOINT or item.params[0] > 0.0
            legs.append(
                MissionLeg(
                    seq=seq, start=here, end=end, asked=leg_mode, stops=hold, is_take_off=item.command in TAKE_OFFS,
                    is_return=returns, goal="" if goal is None else goal.name,
                    hover_speed=hover_speed, airspeed=airspeed, circle=item_radius(item, default_radius),
                )
            )  # fmt: skip
            here = end
    return tuple(legs)


def leg_chains(legs: Sequence[MissionLeg]) -> list[tuple[tuple[int, ...], LegChain]]:
    """The legs in chains without a stop within, as a vehicle plans them: numbers of items, and the question.

    A take-off is no leg that is predicted.
    """
    chains: list[list[MissionLeg]] = []
    for leg in legs:
        before = chains[-1][-1] if chains and not leg.is_return else None
        if before is None or before.stops or _is_slowed(before, leg) or len(chains[-1]) == LEGS_AHEAD:
            chains.append([])
        chains[-1].append(leg)
    heading: float | None = None
    asked = []
    for chain in chains:
        points = (_rounded(chain[0].start), *(_rounded(leg.end) for leg in chain))
        first, modes = chain[0], tuple(leg.asked for leg in chain)
        if not first.is_take_off:
            question = LegChain(points, modes, heading, first.hover_speed, first.airspeed)
            asked.append((tuple(leg.seq for leg in chain), question))
        heading = next((_course(leg) for leg in reversed(chain) if leg.distance > SHORTEST_COURSE), heading)
    return asked


def known_predictions(legs: Sequence[MissionLeg], s: Snapshot) -> dict[int, LegPrediction]:
    """Answers of the vehicle about some legs, by the items that they lead to."""
    known = s.mission.leg_predictions
    answered = [(seqs, known[chain]) for seqs, chain in leg_chains(legs) if chain in known]
    return {seq: leg for seqs, legs in answered for seq, leg in zip(seqs, legs, strict=True)}


def beginning(s: Snapshot) -> Vector:
    """Start of a mission that begins now: home, or in the air about the vehicle's place; NED in its local frame [m]."""
    if s.position.p is None or not s.status.is_airborne:
        return s.position.home_p
    return s.position.near or whole_metres(s.position.p)


def whole_metres(p: Vector, before: Vector | None = None) -> Vector:
    """A place in whole metres, or those before while it is not clearly nearer to others: no hover is quite still."""
    if before is not None and all(abs(now - then) <= LEAVES_METRE for now, then in zip(p, before, strict=True)):
        return before
    north, east, down = (float(round(part)) if math.isfinite(part) else part for part in p)
    return north, east, down


def low_legs(items: Items, s: Snapshot, forward: Collection[int] = (), height: float = LOW_LEG) -> tuple[int, ...]:
    """Items whose legs are flown forward, or are long enough to be, nearer to the ground than a height.

    Args:
        items: The mission.
        s: What is known of the vehicle.
        forward: Items whose legs the vehicle has said to fly forward.
        height: Above home [m].
    """
    legs, level = mission_legs(items, s), s.position.home_p[2] - height + 1e-6
    lowest = [max(leg.end[2], leg.start[2] if before else leg.end[2]) for before, leg in enumerate(legs)]
    return tuple(
        leg.seq
        for leg, down in zip(legs, lowest, strict=True)
        if down > level
        and not leg.is_take_off
        and (
            leg.seq in forward
            or leg.asked == LegMode.FORWARD
            or (leg.asked == LegMode.NONE and leg.distance >= LONG_LEG)
        )
    )


def low_words(
    items: Items, s: Snapshot, predictions: Mapping[int, LegPrediction], height: float = LOW_LEG
) -> list[str]:
    """A warning of low legs in words, or none; see ``low_legs``. A leg that is predicted to be hovered is not low."""
    forward = [seq for seq, prediction in predictions.items() if prediction.leg_mode == LegMode.FORWARD]
    hovered = {seq for seq, prediction in predictions.items() if prediction.leg_mode == LegMode.HOVER}
    low = [seq for seq in low_legs(items, s, forward, height) if seq not in hovered]
    return [f"{LOW_WARNING}{legs_to(low)} below {height:g} m in forward flight"] if low else []


def legs_to(items: Sequence[int]) -> str:
    """Legs by the items that they lead to: "legs to 1, 2"."""
    return f"{'leg' if len(items) == 1 else 'legs'} to {', '.join(map(str, items))}"


def start_item(s: Snapshot) -> int:
    """The item that the mission begins or goes on with, counted from 0: of one that is complete the first one."""
    return 0 if s.mission.state == mavlink.MISSION_STATE_COMPLETE else s.mission.current or 0


def distance_to_start(s: Snapshot) -> float | None:
    """Horizontal distance to the item that the mission begins or goes on with [m]; None if it is not known."""
    legs = mission_legs(s.plans.mission[start_item(s) :], s)
    if s.position.p is None or not legs:
        return None
    return math.dist(s.position.p[:2], legs[0].end[:2])


def _end(command: int, here: Vector, place: Vector | None, height: float) -> Vector:
    if command in TAKE_OFFS and place is None:
        return here[0], here[1], -height
    if place is None:
        return here
    lands = command in LANDINGS or command == mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH
    return (place[0], place[1], min(here[2], place[2])) if lands else place


def _changed(speed: float, hover: float | None, air: float | None) -> tuple[float | None, float | None]:
    if not speed > 0.0:
        return None, None
    return (hover, speed) if speed >= MIN_AIRSPEED else (speed, air)


def _is_slowed(before: MissionLeg, leg: MissionLeg) -> bool:
    return (before.hover_speed, before.airspeed) != (leg.hover_speed, leg.airspeed)


def _course(leg: MissionLeg) -> float:
    return round(math.atan2(leg.end[1] - leg.start[1], leg.end[0] - leg.start[0]), 3)


def _rounded(point: Vector) -> Vector:
    north, east, down = (round(part, 2) + 0.0 for part in point)
    return north, east, down
