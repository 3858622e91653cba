"""The place where a return of a mission comes down: home, a rally point, or the mission's own landing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from darko_gcs.state.mission_items import place_of
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import Items
from protocol.dialect import mavlink
from protocol.frames import Vector

RETURN_PARAMETER = "RTL_TYPE"
HOME_OR_RALLY, NEAREST_OF_ALL = 0.0, 3.0  # of it; else a mission's landing is flown where it has one
LANDINGS = frozenset({mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_VTOL_LAND})


class ReturnGoal(NamedTuple):
    """A place, and its name."""

    place: Vector  # NED in the vehicle's local frame [m]
    name: str = ""  # in the words of a table; empty: home


def return_goal(items: Items, seq: int, here: Vector, s: Snapshot) -> ReturnGoal:
    """The goal of a return, as the vehicle chooses it: the nearest, unless it flies the mission's landing.

    Args:
        items: The mission.
        seq: Number of the item that returns; beyond the last one: a return on request.
        here: Where it begins, NED in the vehicle's local frame [m].
        s: Has home, the rally points and the parameters.
    """
    home = s.position.home
    if home is None:
        return ReturnGoal(s.position.home_p)
    placed = ((number, place_of(item, home, s.position.home_p)) for number, item in enumerate(s.plans.rally))
    points = [ReturnGoal(place, f"rally {number}") for number, place in placed if place is not None]
    nearest = min((ReturnGoal(s.position.home_p), *points), key=lambda goal: math.dist(goal.place[:2], here[:2]))
    kind = s.parameters.values.get(RETURN_PARAMETER)
    landings = [] if kind == HOME_OR_RALLY else list(_landings(items, seq, s))
    landing = min(landings, key=lambda goal: math.dist(goal.place[:2], here[:2]), default=None)
    if landing is None:
        return nearest
    is_farther = math.dist(landing.place[:2], here[:2]) >= math.dist(nearest.place[:2], here[:2])
    return nearest if kind == NEAREST_OF_ALL and is_farther else landing


def _landings(items: Items, seq: int, s: Snapshot) -> Iterator[ReturnGoal]:
    """Beginnings of the mission's landings, but for the one that an item is part of."""
    home = s.position.home
    for start, item in enumerate(items):
        if item.command != mavlink.MAV_CMD_DO_LAND_START or home is None:
            continue
        end = next((k for k in range(start, len(items)) if items[k].command in LANDINGS), None)
        if end is None or start < seq <= end:
            continue
        places = (place_of(items[k], home, s.position.home_p) for k in range(start + 1, end + 1))
        if (place := next((place for place in places if place is not None), None)) is not None:
            yield ReturnGoal(place, f"item {start}")
