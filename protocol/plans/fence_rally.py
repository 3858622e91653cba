"""Fence and rally points: ``geoFence`` and ``rallyPoints`` of a .plan file, converted to mission items and back.

https://mavlink.io/en/services/mission.html and QGroundControl's description of its plan files. A fence of the old form
(version 1) is one polygon to stay in.

Positions are rounded to the nearest step of the wire (1e-7 deg). A radius or an altitude is written as the shortest
decimal with the same float32, so that both conversions are exact inverses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np

from protocol import units
from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.names import is_global_frame
from protocol.plans.plan import MissionItem, Plan
from protocol.ranges import MAX_FLOAT32, MIN_CORNERS
from protocol.tools.files import JsonTable

POLYGON_COMMANDS = {
    True: mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    False: mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
}
CIRCLE_COMMANDS = {True: mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, False: mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION}
RALLY_COMMAND = mavlink.MAV_CMD_NAV_RALLY_POINT
RETURN_COMMAND = mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT
_FENCE_FRAME, _RALLY_FRAME = mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
_RETURN_FRAME = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
_RETURN, _RETURN_FRAME_KEY, _OLD_POLYGON = "breachReturn", "breachReturnFrame", "polygon"
_FENCE_KEYS = {"circles", "polygons", "version", _RETURN, _RETURN_FRAME_KEY, _OLD_POLYGON}


def fence_items(plan: Plan) -> tuple[MissionItem, ...]:
    """The fence of a plan as mission items of type FENCE: polygons, circles, then the return point.

    Raises:
        FileError: ``geoFence`` is not valid; the message names the place in it and the value. So it is if part of it is
            not known: nothing of a fence may be left out.
    """
    fence = JsonTable(dict(plan.geo_fence), _name(plan), "geoFence")
    if fence.values.get("version") not in {None, 1, 2}:
        raise fence.error("version", f"{fence.values['version']!r} is neither 1 nor 2")
    for key, value in fence.others(_FENCE_KEYS).items():
        if value and not isinstance(value, bool | str):
            raise fence.error(key, "is not known as a part of a fence, and would be left out: remove it")
    items: list[MissionItem] = []
    if fence.values.get(_OLD_POLYGON):
        items += _polygon(fence.made({_OLD_POLYGON: fence.values[_OLD_POLYGON]}))
    for index in range(len(_rows(fence, "polygons"))):
        items += _polygon(fence.entry("polygons", index))
    for index in range(len(_rows(fence, "circles"))):
        items.append(_circle(fence.entry("circles", index)))
    if fence.values.get(_RETURN):
        items.append(_return_point(fence))
    return tuple(items)


def rally_items(plan: Plan) -> tuple[MissionItem, ...]:
    """The rally points of a plan as mission items of type RALLY.

    Raises:
        FileError: ``rallyPoints`` is not valid; the message names the place in it and the value.
    """
    table = JsonTable(dict(plan.rally_points), _name(plan), "rallyPoints")
    frames = table.values.get("frames", {})
    items = []
    for index, row in enumerate(_rows(table, "points")):
        lat, lon, alt = _numbers(table, f"points[{index}]", row, 3)
        frame = _frame(table, frames.get(str(index), _RALLY_FRAME) if isinstance(frames, dict) else frames)
        items.append(_item(table, f"points[{index}]", RALLY_COMMAND, frame, (0.0,), lat, lon, alt))
    return tuple(items)


def with_fence(plan: Plan, items: Sequence[MissionItem]) -> Plan:
    """The plan with these items of type FENCE as its fence.

    Raises:
        LocalProtocolError: An item does not belong to a fence, or a polygon is not complete.
    """
    polygons: list[dict[str, Any]] = []
    circles: list[dict[str, Any]] = []
    breach_return: dict[str, Any] = {}
    left = list(items)
    while left:
        first = left[0]
        if first.command == RETURN_COMMAND:
            if breach_return:
                raise LocalProtocolError("a fence has one return point, not two")
            breach_return = _breach_return(left.pop(0))
            continue
        kept = {} if first.frame == _FENCE_FRAME else {"frame": first.frame}
        if first.command in CIRCLE_COMMANDS.values():
            circle = {"center": _position(left.pop(0)), "radius": _decimal(first.params[0])}
            circles.append(
                {"circle": circle, "inclusion": first.command == CIRCLE_COMMANDS[True], "version": 1, **kept}
            )
            continue
        if first.command not in POLYGON_COMMANDS.values() or not MIN_CORNERS <= first.params[0] <= len(left):
            raise LocalProtocolError(f"command {first.command} does not begin a polygon or a circle of a fence")
        count = int(first.params[0])
        corners, left = left[:count], left[count:]
        if len(list(groupby((c.command, c.params[0], c.frame) for c in corners))) != 1:
            raise LocalProtocolError(f"a polygon of {count} corners ends before its last")
        inclusion = first.command == POLYGON_COMMANDS[True]
        polygons.append({"polygon": [_position(c) for c in corners], "inclusion": inclusion, "version": 1, **kept})
    others = {key: value for key, value in plan.geo_fence.items() if key not in _FENCE_KEYS}
    fence = {**others, "circles": circles, "polygons": polygons, **breach_return, "version": 2}
    return replace(plan, geo_fence=fence)


def with_rally(plan: Plan, items: Sequence[MissionItem]) -> Plan:
    """The plan with these items of type RALLY as its rally points.

    Raises:
        LocalProtocolError: An item is not a rally point.
    """
    for item in items:
        if item.command != RALLY_COMMAND or not math.isfinite(item.z):
            raise LocalProtocolError(f"command {item.command} at {item.z:g} m is not a rally point")
    rally = {
        **{key: value for key, value in plan.rally_points.items() if key != "frames"},
        "points": [[*_position(item), _decimal(item.z)] for item in items],
        "version": 2,
    }
    frames = {str(index): item.frame for index, item in enumerate(items) if item.frame != _RALLY_FRAME}
    return replace(plan, rally_points=rally | ({"frames": frames} if frames else {}))


def _return_point(fence: JsonTable) -> MissionItem:
    """Point to which a vehicle returns after a breach; the old form leaves the altitude open."""
    old = len(fence.rows(_RETURN)) == 2
    lat, lon, alt = (*fence.numbers(_RETURN, 2), math.nan) if old else fence.numbers(_RETURN, 3)
    frame = _frame(fence, fence.values.get(_RETURN_FRAME_KEY, _RETURN_FRAME))
    point = _item(fence, _RETURN, RETURN_COMMAND, frame, (0.0,), lat, lon, 0.0 if math.isnan(alt) else alt)
    return replace(point, z=alt)


def _breach_return(item: MissionItem) -> dict[str, Any]:
    """The same as keys of ``geoFence``."""
    if math.isinf(item.z):
        raise LocalProtocolError(f"command {item.command} at {item.z:g} m is not a return point")
    point = [*_position(item), *([] if math.isnan(item.z) else [_decimal(item.z)])]
    return {_RETURN: point} | ({} if item.frame == _RETURN_FRAME else {_RETURN_FRAME_KEY: item.frame})


def _polygon(entry: JsonTable) -> list[MissionItem]:
    corners = entry.rows("polygon")
    if len(corners) < MIN_CORNERS:
        raise entry.error("polygon", f"{len(corners)} corners are too few for a polygon")
    command = POLYGON_COMMANDS[entry.flag("inclusion", default=True)]
    frame = _frame(entry, entry.values.get("frame", _FENCE_FRAME))
    items = []
    for index, corner in enumerate(corners):
        lat, lon = _numbers(entry, f"polygon[{index}]", corner, 2)
        items.append(_item(entry, f"polygon[{index}]", command, frame, (float(len(corners)),), lat, lon, 0.0))
    return items


def _circle(entry: JsonTable) -> MissionItem:
    circle = entry.table("circle")
    lat, lon = circle.numbers("center", 2)
    radius = circle.number("radius", 0.0)
    if not 0.0 < radius <= MAX_FLOAT32:
        raise circle.error("radius", f"{radius:g} m is not a radius")
    command = CIRCLE_COMMANDS[entry.flag("inclusion", default=True)]
    frame = _frame(entry, entry.values.get("frame", _FENCE_FRAME))
    return _item(circle, "center", command, frame, (radius,), lat, lon, 0.0)


def _item(
    table: JsonTable, key: str, command: int, frame: int, first: tuple[float], lat: float, lon: float, z: float
) -> MissionItem:
    if not (abs(lat) <= 90.0 and abs(lon) <= 180.0 and abs(z) <= MAX_FLOAT32):
        raise table.error(key, f"{lat:g}, {lon:g}, {z:g} is not on the globe")
    return MissionItem(
        command=command,
        frame=frame,
        params=(*first, 0.0, 0.0, 0.0),
        x=units.to_e7(lat),
        y=units.to_e7(lon),
        z=z,
    )


def _frame(table: JsonTable, frame: object) -> int:
    if not isinstance(frame, int) or not is_global_frame(frame):
        raise table.error("frame", f"{frame!r} is not a global MAV_FRAME")
    return frame


def _numbers(table: JsonTable, key: str, row: object, count: int) -> list[float]:
    try:
        return JsonTable({"_": row}, "").numbers("_", count)
    except FileError as error:
        raise table.error(key, str(error).split(": ", 2)[-1]) from None


def _rows(table: JsonTable, key: str) -> list[Any]:
    return table.rows(key) if key in table.values else []


def _position(item: MissionItem) -> list[float]:
    return [units.from_e7(item.x), units.from_e7(item.y)]


def _decimal(value: float) -> float:
    return float(str(np.float32(value)))


def _name(plan: Plan) -> str:
    return str(plan.source or "plan")
