"""Content that every map shows of a snapshot: the vehicle, its track and its mission."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.maps.plan_overlay import item_position
from darko_gcs.tui.render.map_drawing import MapContent, NorthEast
from protocol.dialect import mavlink
from protocol.plans import MissionItem

__all__ = ["flight_content", "home_place", "loiter_circles", "other_vehicles", "waypoints"]

COURSE_TIME = 3.0  # of flight that the course line shows [s]
MIN_COURSE_SPEED = 0.5  # below which there is no course line [m/s]
MAX_OTHER_DISTANCE = 5000.0  # of another vehicle that the map still shows [m]
LOITER_COMMANDS = frozenset(
    {mavlink.MAV_CMD_NAV_LOITER_UNLIM, mavlink.MAV_CMD_NAV_LOITER_TURNS, mavlink.MAV_CMD_NAV_LOITER_TIME}
)


def flight_content(s: Snapshot, **shown: Any) -> MapContent:  # noqa: ANN401 - the fields of MapContent
    """The vehicle, its course, target and track, and what else is shown."""
    vehicle = None if s.p is None else (s.p[0], s.p[1], s.heading or 0.0)
    return MapContent(track=s.track, vehicle=vehicle, target=_target_place(s), course=_position_ahead(s), **shown)


def home_place(s: Snapshot) -> NorthEast | None:
    """Home, north and east [m]; None until it is known."""
    return None if s.home is None else s.home_p[:2]


def other_vehicles(s: Snapshot, fleet: Iterable[Snapshot]) -> list[tuple[int, float, float, float]]:
    """Id, north, east [m] and heading [rad] of the other vehicles near a vehicle."""
    placed = (
        (other.source[0], s.local(other.geodetic), other.heading or 0.0)
        for other in fleet
        if other.source is not None and other.source != s.source and other.geodetic is not None
    )
    here = s.p or s.home_p
    return [
        (system, place[0], place[1], heading)
        for system, place, heading in placed
        if place is not None and math.dist(place[:2], here[:2]) < MAX_OTHER_DISTANCE
    ]


def _target_place(s: Snapshot) -> NorthEast | None:
    """Present target of the vehicle, north and east [m]; None on the ground."""
    on_ground = s.landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND
    return None if s.goal is None or on_ground else s.goal[:2]


def _position_ahead(s: Snapshot) -> NorthEast | None:
    """Position of the vehicle in a few seconds, north and east [m]; None while it stands still."""
    if s.p is None or s.v is None or math.hypot(s.v[0], s.v[1]) < MIN_COURSE_SPEED:
        return None
    return s.p[0] + COURSE_TIME * s.v[0], s.p[1] + COURSE_TIME * s.v[1]


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
    is_current = s.mission_current == seq and s.mission_state != mavlink.MISSION_STATE_COMPLETE
    return "done" if seq in s.reached else "current" if is_current else "todo"


def _placed_items(s: Snapshot) -> list[tuple[int, MissionItem, NorthEast]]:
    places = ((seq, item, item_position(s, item)) for seq, item in enumerate(s.mission))
    return [(seq, item, place) for seq, item, place in places if place is not None]
