"""Contents of the map: the flight and its trail, missions, fences and rally points, a flight plan."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import Any

from darko_gcs.state.arena import net_corners, net_label
from darko_gcs.state.fence_shapes import fence_circles, fence_polygons, item_position, rally_points
from darko_gcs.state.flight_plan_state import PlanPoint
from darko_gcs.state.law_reason import is_wind_guessed
from darko_gcs.state.map_overlay import Overlay, OverlayShape
from darko_gcs.state.mission_items import mission_command_of, place_of
from darko_gcs.state.mission_legs import LOW_LEG, low_legs, mission_legs
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import MISSION, PLAN_TYPES, Items
from darko_gcs.tui.render.map_drawing import MapContent, MapLabel, MapShape, NorthEast
from protocol.dialect import mavlink
from protocol.plans import MissionItem
from protocol.ranges import MIN_CORNERS


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
    """The mission, fence and rally points that are edited, and the vehicle's progress on them."""

    def __init__(self) -> None:
        self._plans: tuple[Items, Items, Items] = ((), (), ())
        self._part = MISSION  # MAV_MISSION_TYPE whose points are chosen and moved
        self._blocked: tuple[int, ...] = ()  # items whose legs must not be flown
        self._low_leg = LOW_LEG  # [m]
        self._is_flown = False

    def show(
        self,
        plans: tuple[Items, Items, Items],
        part: int = MISSION,
        warned: tuple[tuple[int, ...], float] = ((), LOW_LEG),
        *,
        is_on_vehicle: bool,
    ) -> bool:
        """Show other plans; False if nothing is other than before.

        Args:
            plans: A mission, its fence and its rally points.
            part: MAV_MISSION_TYPE of the one whose points are chosen and moved.
            warned: Items whose legs must not be flown, and the height below which a leg is low [m].
            is_on_vehicle: The vehicle has them: its progress is shown.
        """
        before = (self._plans, self._part, self._blocked, self._low_leg, self._is_flown)
        self._plans, self._part, self._is_flown = plans, part, is_on_vehicle
        self._blocked, self._low_leg = warned
        return (plans, part, *warned, is_on_vehicle) != before

    def places(self, s: Snapshot) -> dict[int, NorthEast]:
        """Positions of the items that have a place, by number [m]."""
        items = self._plans[PLAN_TYPES.index(self._part)]
        placed = ((seq, item_position(s, item)) for seq, item in enumerate(items))
        return {seq: place for seq, place in placed if place is not None}

    def content(self, s: Snapshot, chosen: int) -> MapContent:
        """All that is on the map, with a mark on the chosen item."""
        places = self.places(s)
        place = places.get(chosen)
        mission, fence, rally = self._plans
        s = s._replace(
            plans=s.plans._replace(mission=mission, fence=fence or s.plans.fence, rally=rally or s.plans.rally)
        )
        s = s if self._is_flown else s._replace(mission=s.mission._replace(reached=frozenset(), current=None))
        corners: list[MapLabel] = []
        if self._part != MISSION:
            corners = [("·", at, "plan") for seq, at in places.items() if seq != chosen]
        return flight_content(
            s,
            home=home_place(s),
            waypoints=waypoints(s),
            circles=[*loiter_circles(s), *fence_circles(s)],
            areas=fence_polygons(s),
            rally=rally_points(s),
            labels=[
                *corners,
                *self._heights(s, chosen if self._part == MISSION else None),
                *([] if place is None else [(f"{chosen}◆", place, "warn")]),
                *return_labels(s),
            ],
        )

    def _heights(self, s: Snapshot, chosen: int | None) -> list[MapLabel]:
        """Number and height of each other item with a place; of warned legs in the colour of a warning."""
        low = set(low_legs(self._plans[0], s, height=self._low_leg))
        return height_labels(s, chosen, low, self._blocked)

    def is_empty(self, s: Snapshot) -> bool:
        """True while nothing was put on the map, and no fence says how large the place is."""
        return not any(self._plans) and not s.plans.fence and s.arena is None


def return_labels(s: Snapshot) -> list[MapLabel]:
    """Number of each return of the mission at the rally point where it lands."""
    returns = [leg for leg in mission_legs(s.plans.mission, s) if leg.goal]
    return [(f"{leg.seq} lands", (leg.end[0], leg.end[1]), "warn") for leg in returns]


def height_labels(
    s: Snapshot, chosen: int | None = None, low: Collection[int] = (), blocked: Collection[int] = ()
) -> list[MapLabel]:
    """Number and height above home of each item of the mission that has a place.

    Args:
        s: Has the mission.
        chosen: An item that is marked in another way.
        low: Items whose legs are low.
        blocked: Items whose legs must not be flown.
    """
    if s.position.home is None:
        return []
    labels: list[MapLabel] = []
    for seq, item in enumerate(s.plans.mission):
        place = place_of(item, s.position.home, s.position.home_p) if mission_command_of(item).has_place else None
        if seq != chosen and place is not None:
            sign, style = ("✗", "bad") if seq in blocked else ("!", "warn") if seq in low else ("", "dim")
            labels.append((f"{seq} {s.position.home_p[2] - place[2] + 0.0:.0f}m{sign}", place[:2], style))
    return labels


PREDICTED_TIME = 6.0  # of flight that the predicted path shows [s]
PREDICTED_STEP = 0.5  # between points of it [s]
MIN_COURSE_SPEED = 0.5  # below which there is no predicted path [m/s]
CHORD_TIME = 1.0  # of the flown path that the turn is seen from [s]
MAX_TURN_RATE = 1.5  # that is predicted [rad/s]
MIN_TURN_SPEED = 4.0  # below which it is flown along straight lines with sharp corners [m/s]
LOST = "lost"  # the vehicle, where north and east are dead reckoning
MIN_SHOWN_WIND = 0.3  # [m/s]
MAX_OTHER_DISTANCE = 5000.0  # of another vehicle that the map still shows [m]
LOITER_COMMANDS = frozenset(
    {mavlink.MAV_CMD_NAV_LOITER_UNLIM, mavlink.MAV_CMD_NAV_LOITER_TURNS, mavlink.MAV_CMD_NAV_LOITER_TIME}
)


def flight_content(s: Snapshot, **shown: Any) -> MapContent:  # noqa: ANN401 - the fields of MapContent
    """The vehicle, its predicted path, target and track, the wind, and what else is shown; "lost" without a place."""
    name = f"{shown.pop('name', '')} {LOST}" if s.estimates.is_place_lost else shown.pop("name", "")
    vehicle = None if s.position.p is None else (s.position.p[0], s.position.p[1], s.attitude.heading or 0.0)
    wind = s.estimates.wind
    is_calm = wind is None or is_wind_guessed(s) or not math.hypot(wind[0], wind[1]) >= MIN_SHOWN_WIND
    if s.arena is not None and (corners := net_corners(s)):
        shown["areas"] = [*shown.get("areas", ()), (corners, "fence")]
        shown["labels"] = [*shown.get("labels", ()), (net_label(s.arena), corners[-1], "fence")]
    return MapContent(
        track=s.position.track,
        vehicle=vehicle,
        name=name,
        target=_target_place(s),
        predicted=predicted_path(s),
        wind=None if wind is None or is_calm else wind[:2],
        **shown,
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


def predicted_path(s: Snapshot) -> tuple[NorthEast, ...]:
    """Places of the next seconds at the present speed and turn, north and east [m]; empty while it stands still."""
    p, v = s.position.p, s.position.v
    speed = 0.0 if v is None else math.hypot(v[0], v[1])
    if p is None or v is None or not speed >= MIN_COURSE_SPEED:
        return ()
    course, turn = math.atan2(v[1], v[0]), _turn_rate(s, speed)
    north, east, path = p[0], p[1], [(p[0], p[1])]
    for k in range(round(PREDICTED_TIME / PREDICTED_STEP)):
        middle = course + turn * PREDICTED_STEP * (k + 0.5)
        north += speed * PREDICTED_STEP * math.cos(middle)
        east += speed * PREDICTED_STEP * math.sin(middle)
        path.append((north, east))
    return tuple(path)


def _turn_rate(s: Snapshot, speed: float) -> float:
    """Turn of the flown path, clockwise [rad/s]: on a circle the course is off a chord by half of the arc's angle."""
    p, v = s.position.p, s.position.v
    if speed < MIN_TURN_SPEED:
        return 0.0
    reach = speed * CHORD_TIME
    back = next((place for place in reversed(s.position.track) if p and math.dist(place, p[:2]) >= reach), None)
    if p is None or v is None or back is None or math.dist(back, p[:2]) > 2.0 * reach:
        return 0.0
    chord = (p[0] - back[0], p[1] - back[1])
    off = math.atan2(chord[0] * v[1] - chord[1] * v[0], chord[0] * v[0] + chord[1] * v[1])
    rate = 2.0 * math.sin(off) * speed / math.hypot(*chord)
    return max(-MAX_TURN_RATE, min(MAX_TURN_RATE, rate))


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


class PlacedOverlay:
    """The pilot's shapes in the vehicle's local frame, placed again only when home is another.

    Args:
        overlay: The shapes.
    """

    def __init__(self, overlay: Overlay = ()) -> None:
        self.overlay = overlay
        self._frame: object = None
        self._shapes: list[MapShape] = []

    def shapes(self, s: Snapshot) -> list[MapShape]:
        """Name, line and style of each; empty until home is known."""
        frame = (s.position.home, s.position.home_p, s.position.start)
        if frame != self._frame:
            self._frame, self._shapes = frame, [shape for one in self.overlay if (shape := _placed_shape(s, one))]
        return self._shapes


def _placed_shape(s: Snapshot, shape: OverlayShape) -> MapShape | None:
    places = tuple(place[:2] for point in shape.points if (place := s.position.local(point)) is not None)
    if len(places) < len(shape.points) or not places:
        return None
    closed = (*places, places[0]) if shape.is_area else places
    return shape.name, closed, "mark" if shape.top is not None else "label"
