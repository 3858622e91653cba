"""Contents of the map: the flight and its trail, missions, fences and rally points, a flight plan."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from darko_gcs.state.flight_plan_state import PlanPoint
from darko_gcs.state.mission_items import mission_command_of, place_of
from darko_gcs.state.mission_legs import low_legs
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import Items
from darko_gcs.tui.render.map_drawing import MapContent, MapLabel, NorthEast
from protocol.dialect import mavlink
from protocol.frames import Geodetic
from protocol.names import is_global_frame
from protocol.plans import MissionItem
from protocol.ranges import MIN_CORNERS
from protocol.units import from_e7, from_local_e4

# State on the map by command: "fence" to stay inside, "keep-out" to stay outside.
POLYGON_STATES = {
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: "fence",
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: "keep-out",
}
CIRCLE_STATES = {
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: "fence",
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: "keep-out",
}


def fence_polygons(s: Snapshot) -> list[tuple[tuple[NorthEast, ...], str]]:
    """Corners and state of every polygon of the fence; incomplete polygons are left out."""
    polygons, rest = [], list(s.plans.fence)
    while rest:
        state, count = POLYGON_STATES.get(rest[0].command), rest[0].params[0]
        items = rest[: max(1, int(count))] if state is not None and count < len(rest) + 1 else rest[:1]
        rest = rest[len(items) :]
        corners = _positions(s, items)
        if state is not None and len(corners) == len(items) >= MIN_CORNERS:
            polygons.append((corners, state))
    return polygons


def fence_circles(s: Snapshot) -> list[tuple[float, float, float, str]]:
    """North, east, radius [m] and state of every circle of the fence."""
    placed = ((item, item_position(s, item)) for item in s.plans.fence if item.command in CIRCLE_STATES)
    return [(*place, item.params[0], CIRCLE_STATES[item.command]) for item, place in placed if place is not None]


def rally_points(s: Snapshot) -> list[NorthEast]:
    """North and east [m] of every rally point."""
    return list(_positions(s, s.plans.rally))


def _positions(s: Snapshot, items: Iterable[MissionItem]) -> tuple[NorthEast, ...]:
    return tuple(place for place in (item_position(s, item) for item in items) if place is not None)


def item_position(s: Snapshot, item: MissionItem) -> NorthEast | None:
    """North and east [m]; None for an item without a place, or until home is known."""
    if (item.x == 0 and item.y == 0 and is_global_frame(item.frame)) or item.frame == mavlink.MAV_FRAME_MISSION:
        return None
    if not is_global_frame(item.frame):
        x, y = from_local_e4(item.x), from_local_e4(item.y)
        here = s.position.from_vehicle_frame((y, x, 0.0) if item.frame == mavlink.MAV_FRAME_LOCAL_ENU else (x, y, 0.0))
        return None if here is None else here[:2]
    local = s.position.local(Geodetic(from_e7(item.x), from_e7(item.y), 0.0))
    return None if local is None else local[:2]


class LoadedFlightPlan:
    """The flight plan that the vehicle has loaded."""

    def is_empty(self, s: Snapshot) -> bool:  # noqa: ARG002 - of every map's source
        """Never: it is not drawn here."""
        return False

    def places(self, s: Snapshot) -> dict[int, NorthEast]:
        """Positions of the shown waypoints, by number [m]."""
        points = () if s.flight_plan is None else s.flight_plan.points.values()
        placed = ((point.number, point_position(s, point)) for point in points if point.is_shown)
        return {number: place for number, place in placed if place is not None}

    def content(self, s: Snapshot, chosen: int) -> MapContent:
        """All that is on the map, with a mark on the chosen waypoint."""
        return flight_content(
            s,
            circles=fence_circles(s),
            areas=[*fence_polygons(s), *plan_polygons(s)],
            labels=plan_labels(s, chosen),
        )


def point_position(s: Snapshot, point: PlanPoint) -> NorthEast | None:
    """North and east [m] of a waypoint; None until home is known."""
    place = None if point.place is None else s.position.local(point.place)
    return None if place is None else place[:2]


def plan_labels(s: Snapshot, chosen: int = 0) -> list[MapLabel]:
    """The waypoints that the plan shows; the chosen one is marked."""
    plan = s.flight_plan
    if plan is None:
        return []
    shown = [point for point in plan.points.values() if point.is_shown or point.number == chosen]
    placed = [(point, point_position(s, point)) for point in sorted(shown, key=lambda point: point.number == chosen)]
    return [
        (f"{'◆' if point.number == chosen else '·'}{point.name}", place, "warn" if point.number == chosen else "plan")
        for point, place in placed
        if place is not None
    ]


def plan_polygons(s: Snapshot) -> list[tuple[tuple[NorthEast, ...], str]]:
    """Corners and state of every sector: "fence" if the plan stays inside."""
    plan = s.flight_plan
    if plan is None:
        return []
    polygons = []
    for area in plan.areas.values():
        corners = [point_position(s, plan.points[number]) for number in area.corners if number in plan.points]
        placed = tuple(corner for corner in corners if corner is not None)
        if len(placed) == len(area.corners) >= MIN_CORNERS:
            polygons.append((placed, "fence" if area.is_fence else "sector"))
    return polygons


class EditedMission:
    """The items of the plan that is edited, and the vehicle's progress on them."""

    def __init__(self) -> None:
        self._plans: tuple[Items, Items, Items] = ((), (), ())
        self._is_flown = False

    def show(self, plans: tuple[Items, Items, Items], *, is_on_vehicle: bool) -> bool:
        """Show a mission, its fence and its rally points; the vehicle's progress if it has them. False: as before."""
        is_new = (plans, is_on_vehicle) != (self._plans, self._is_flown)
        self._plans, self._is_flown = plans, is_on_vehicle
        return is_new

    def places(self, s: Snapshot) -> dict[int, NorthEast]:
        """Positions of the items that have a place, by number [m]."""
        placed = ((seq, item_position(s, item)) for seq, item in enumerate(self._plans[0]))
        return {seq: place for seq, place in placed if place is not None}

    def content(self, s: Snapshot, chosen: int) -> MapContent:
        """All that is on the map, with a mark on the chosen item."""
        place = self.places(s).get(chosen)
        mission, fence, rally = self._plans
        s = s._replace(
            plans=s.plans._replace(mission=mission, fence=fence or s.plans.fence, rally=rally or s.plans.rally)
        )
        s = s if self._is_flown else s._replace(mission=s.mission._replace(reached=frozenset(), current=None))
        return flight_content(
            s,
            home=home_place(s),
            waypoints=waypoints(s),
            circles=[*loiter_circles(s), *fence_circles(s)],
            areas=fence_polygons(s),
            rally=rally_points(s),
            labels=[*self._heights(s, chosen), *([] if place is None else [(f"{chosen}◆", place, "warn")])],
        )

    def _heights(self, s: Snapshot, chosen: int) -> list[MapLabel]:
        """Number and height above home of each other item with a place; low ones in the colour of a warning."""
        if s.position.home is None:
            return []
        low = low_legs(self._plans[0], s)
        return [
            (f"{seq} {s.position.home_p[2] - place[2]:.0f}m", place[:2], "warn" if seq in low else "dim")
            for seq, item in enumerate(self._plans[0])
            if seq != chosen
            and mission_command_of(item).has_place
            and (place := place_of(item, s.position.home, s.position.home_p)) is not None
        ]

    def is_empty(self, s: Snapshot) -> bool:
        """True while nothing was put on the map, and no fence says how large the place is."""
        return not any(self._plans) and not s.plans.fence


COURSE_TIME = 3.0  # of flight that the course line shows [s]
MIN_COURSE_SPEED = 0.5  # below which there is no course line [m/s]
MAX_OTHER_DISTANCE = 5000.0  # of another vehicle that the map still shows [m]
LOITER_COMMANDS = frozenset(
    {mavlink.MAV_CMD_NAV_LOITER_UNLIM, mavlink.MAV_CMD_NAV_LOITER_TURNS, mavlink.MAV_CMD_NAV_LOITER_TIME}
)


def flight_content(s: Snapshot, **shown: Any) -> MapContent:  # noqa: ANN401 - the fields of MapContent
    """The vehicle, its course, target and track, and what else is shown."""
    vehicle = None if s.position.p is None else (s.position.p[0], s.position.p[1], s.attitude.heading or 0.0)
    return MapContent(
        track=s.position.track, vehicle=vehicle, target=_target_place(s), course=_position_ahead(s), **shown
    )


def home_place(s: Snapshot) -> NorthEast | None:
    """Home, north and east [m]; None until it is known."""
    return None if s.position.home is None else s.position.home_p[:2]


def other_vehicles(s: Snapshot, fleet: Iterable[Snapshot]) -> list[tuple[int, float, float, float]]:
    """Id, north, east [m] and heading [rad] of the other vehicles near a vehicle."""
    placed = (
        (other.identity.source[0], s.position.local(other.position.geodetic), other.attitude.heading or 0.0)
        for other in fleet
        if other.identity.source is not None
        and other.identity.source != s.identity.source
        and other.position.geodetic is not None
    )
    here = s.position.p or s.position.home_p
    return [
        (system, place[0], place[1], heading)
        for system, place, heading in placed
        if place is not None and math.dist(place[:2], here[:2]) < MAX_OTHER_DISTANCE
    ]


def _target_place(s: Snapshot) -> NorthEast | None:
    """Present target of the vehicle, north and east [m]; None on the ground."""
    on_ground = s.status.landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND
    return None if s.goal is None or on_ground else s.goal[:2]


def _position_ahead(s: Snapshot) -> NorthEast | None:
    """Position of the vehicle in a few seconds, north and east [m]; None while it stands still."""
    if s.position.p is None or s.position.v is None or math.hypot(s.position.v[0], s.position.v[1]) < MIN_COURSE_SPEED:
        return None
    return s.position.p[0] + COURSE_TIME * s.position.v[0], s.position.p[1] + COURSE_TIME * s.position.v[1]


def waypoints(s: Snapshot) -> list[tuple[int, float, float, str]]:
    """Number, north, east [m] and state of every mission item with a place."""
    return [(seq, *place, _state(s, seq)) for seq, _, place in _placed_items(s)]


def loiter_circles(s: Snapshot) -> list[tuple[float, float, float, str]]:
    """North, east, radius [m] and state of every circle that the mission loiters on."""
    loiters = [(seq, place, abs(item.params[2])) for seq, item, place in _placed_items(s) if _is_loiter(item)]
    return [(*place, radius, _state(s, seq)) for seq, place, radius in loiters if radius > 0.0]


def _is_loiter(item: MissionItem) -> bool:
    return item.command in LOITER_COMMANDS


def _state(s: Snapshot, seq: int) -> str:
    is_current = s.mission.current == seq and s.mission.state != mavlink.MISSION_STATE_COMPLETE
    return "done" if seq in s.mission.reached else "current" if is_current else "todo"


def _placed_items(s: Snapshot) -> list[tuple[int, MissionItem, NorthEast]]:
    places = ((seq, item, item_position(s, item)) for seq, item in enumerate(s.plans.mission))
    return [(seq, item, place) for seq, item, place in places if place is not None]
