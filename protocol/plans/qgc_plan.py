"""QGroundControl's .plan (https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html)."""

from __future__ import annotations

import json
import math
from typing import Any

from protocol import units
from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.frames import Geodetic
from protocol.plans.mission import MissionItem
from protocol.plans.plan import Plan

__all__ = ["parse", "render"]

DO_JUMP = mavlink.MAV_CMD_DO_JUMP


def parse(text: str, name: str) -> Plan:
    """A plan from the text of a file called ``name``.

    Raises:
        FileError: If it is not a valid plan.
    """
    try:
        root = json.loads(text)
    except ValueError as error:
        raise FileError(f"{name}: not JSON: {error}") from error
    if not isinstance(root, dict) or root.get("fileType") != "Plan":
        raise FileError(f"{name}: fileType is not 'Plan'")
    mission = _table(root, "mission", name)
    entries = mission.get("items")
    if not isinstance(entries, list):
        raise FileError(f"{name}: mission.items is not a list")
    jump_ids = {_jump_id(entry, index): index for index, entry in enumerate(entries)}
    items = tuple(_item(entry, index, jump_ids, name) for index, entry in enumerate(entries))
    return Plan(
        items=items,
        planned_home=_home(mission.get("plannedHomePosition"), name),
        cruise_speed=_number(mission.get("cruiseSpeed", 15.0), "mission.cruiseSpeed", name),
        hover_speed=_number(mission.get("hoverSpeed", 3.0), "mission.hoverSpeed", name),
        geo_fence=_table(root, "geoFence", name, {"circles": [], "polygons": [], "version": 2}),
        rally_points=_table(root, "rallyPoints", name, {"points": [], "version": 2}),
    )


def render(plan: Plan, name: str) -> str:
    """The text of a .plan file.

    Raises:
        FileError: If a fence or rally point kept aside cannot be written as JSON.
    """
    home = plan.planned_home
    root = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "DarkO",
        "mission": {
            "version": 2,
            "firmwareType": mavlink.MAV_AUTOPILOT_PX4,
            "vehicleType": mavlink.MAV_TYPE_VTOL_DUOROTOR,
            "cruiseSpeed": plan.cruise_speed,
            "hoverSpeed": plan.hover_speed,
            "plannedHomePosition": None if home is None else [home.lat_deg, home.lon_deg, home.alt],
            "items": [_entry(item, seq) for seq, item in enumerate(plan.items)],
        },
        "geoFence": plan.geo_fence,
        "rallyPoints": plan.rally_points,
    }
    try:
        return json.dumps(root, indent=4, allow_nan=False) + "\n"
    except (TypeError, ValueError) as error:
        raise FileError(f"{name}: {error}") from error


def _entry(item: MissionItem, seq: int) -> dict[str, Any]:
    scale = units.from_e7 if units.is_global_frame(item.frame) else units.from_local_e4
    params: list[float | None] = [*item.params, scale(item.x), scale(item.y), item.z]
    if item.command == DO_JUMP:
        params[0] = item.params[0] + 1  # files count from doJumpId 1
    return {
        "type": "SimpleItem",
        "command": item.command,
        "frame": item.frame,
        "params": [None if value is not None and math.isnan(value) else value for value in params],
        "autoContinue": item.autocontinue,
        "doJumpId": seq + 1,
    }


def _jump_id(entry: object, index: int) -> int:
    number = entry.get("doJumpId", index + 1) if isinstance(entry, dict) else index + 1
    return number if isinstance(number, int) else index + 1


def _item(entry: object, index: int, jump_ids: dict[int, int], name: str) -> MissionItem:
    where = f"mission item {index}"
    if not isinstance(entry, dict):
        raise FileError(f"{name}: {where} is not a table")
    if entry.get("type") != "SimpleItem":
        kind = entry.get("complexItemType", entry.get("type"))
        raise FileError(f"{name}: {where} is a {kind!r}: only SimpleItem can be flown")
    command = _whole(entry.get("command"), f"{where}: command", name)
    frame = _whole(entry.get("frame"), f"{where}: frame", name)
    params = entry.get("params")
    if not isinstance(params, list) or len(params) != 7:
        raise FileError(f"{name}: {where}: params is not a list of 7")
    values = [math.nan if p is None else _number(p, f"{where}: param {n}", name) for n, p in enumerate(params, 1)]
    if command == DO_JUMP:
        values[0] = _jump_target(values[0], jump_ids, where, name)
    # A place left open is null in the file and 0, 0 on the wire.
    values[4:6] = [0.0 if math.isnan(value) else value for value in values[4:6]]
    is_global = units.is_global_frame(frame)
    scale = units.to_e7 if is_global else units.local_e4
    if is_global and not (abs(values[4]) <= 90.0 and abs(values[5]) <= 180.0):
        raise FileError(f"{name}: {where}: position {values[4]:g}, {values[5]:g} is not on the globe")
    try:
        x, y = (scale(value) for value in values[4:6])
        first = (values[0], values[1], values[2], values[3])
        return MissionItem(command, frame, first, x, y, values[6], bool(entry.get("autoContinue", True)))
    except LocalProtocolError as error:
        raise FileError(f"{name}: {where}: {error}") from error


def _jump_target(wanted: float, jump_ids: dict[int, int], where: str, name: str) -> float:
    if wanted not in jump_ids:
        raise FileError(f"{name}: {where}: jumps to doJumpId {wanted:g}, which no item has")
    return float(jump_ids[int(wanted)])


def _home(value: object, name: str) -> Geodetic | None:
    if value is None:
        return None
    if not isinstance(value, list) or len(value) != 3:
        raise FileError(f"{name}: mission.plannedHomePosition is not [latitude, longitude, altitude]")
    numbers = [_number(part, "mission.plannedHomePosition", name) for part in value]
    return Geodetic(*numbers)


def _table(parent: dict[str, Any], key: str, name: str, default: dict[str, Any] | None = None) -> dict[str, Any]:
    value = parent.get(key, default)
    if not isinstance(value, dict):
        raise FileError(f"{name}: {key} is not a table")
    return value


def _number(value: object, where: str, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise FileError(f"{name}: {where} is {value!r}, not a number")
    return value


def _whole(value: object, where: str, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= 0xFFFF:
        raise FileError(f"{name}: {where} is {value!r}, not a whole number from 0 to 65535")
    return value
