"""QGroundControl's .plan (https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from protocol.errors import FileError, LocalProtocolError
from protocol.frames import Geodetic
from protocol.plans.item_values import DO_JUMP, item_from_values, values_of
from protocol.plans.plan import ComplexItem, MissionItem, Plan, places, renumbered, simple_entries
from protocol.tools.files import JsonTable

_FILE_KEYS = {"fileType", "version", "mission", "geoFence", "rallyPoints"}
_MISSION_KEYS = {"version", "items", "plannedHomePosition", "cruiseSpeed", "hoverSpeed"}
_ITEM_KEYS = {"type", "command", "frame", "params", "autoContinue", "doJumpId"}


def parse(text: str, name: str) -> Plan:
    """A plan from the text of a file called ``name``.

    Raises:
        FileError: It is not a valid plan; the message names the place and the value.
    """
    root = JsonTable(_json(text, name), name)
    root.expect("fileType", "Plan")
    root.expect("version", 1)
    mission = root.table("mission")
    mission.expect("version", 2)
    entries, complex_places = _entries(mission)
    seqs = _seq_by_jump_id(entries)
    items = tuple(_item(entry, seqs) for entry in entries)
    empty = Plan()
    return Plan(
        items=items,
        planned_home=_home(mission),
        cruise_speed=mission.number("cruiseSpeed", empty.cruise_speed),
        hover_speed=mission.number("hoverSpeed", empty.hover_speed),
        geo_fence=dict(root.table("geoFence", empty.geo_fence).values),
        rally_points=dict(root.table("rallyPoints", empty.rally_points).values),
        file_keys=root.others(_FILE_KEYS),
        mission_keys=mission.others(_MISSION_KEYS),
        item_keys=_item_keys(entries),
        complex_items=tuple(
            ComplexItem(mission.entry("items", index).values, items[first:end])
            for index, (first, end) in complex_places.items()
        ),
    )


def render(plan: Plan, name: str) -> str:
    """The text of a .plan file. QGroundControl only loads one with a planned home.

    Raises:
        FileError: An item, or content that is not interpreted, cannot be written.
    """
    others = plan.item_keys if len(plan.item_keys) == len(plan.items) else ({},) * len(plan.items)
    jump_ids = [keys.get("doJumpId", seq) for seq, keys in enumerate(others, 1)]
    mission = {
        "version": 2,
        "cruiseSpeed": plan.cruise_speed,
        "hoverSpeed": plan.hover_speed,
        "items": _rows(plan, jump_ids, others, name),
    }
    if (home := plan.planned_home) is not None:
        mission["plannedHomePosition"] = [home.lat_deg, home.lon_deg, home.alt]
    root = {
        **plan.file_keys,
        "fileType": "Plan",
        "version": 1,
        "mission": {**plan.mission_keys, **mission},
        "geoFence": plan.geo_fence,
        "rallyPoints": plan.rally_points,
    }
    try:
        return json.dumps(root, indent=4, allow_nan=False) + "\n"
    except (TypeError, ValueError) as error:
        raise FileError(f"{name}: cannot be written as JSON: {error}") from error


def _json(text: str, name: str) -> object:
    def refuse(literal: str) -> None:
        raise ValueError(f"{literal} is not a JSON number")

    try:
        return json.loads(text, parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        raise FileError(f"{name}: not JSON: {error}") from error


def _entries(mission: JsonTable) -> tuple[list[JsonTable], dict[int, tuple[int, int]]]:
    """The simple items of a mission, and which of them each complex item stands for: the first, and after the last."""
    entries: list[JsonTable] = []
    complex_places = {}
    for index in range(len(mission.rows("items"))):
        entry = mission.entry("items", index)
        if entry.values.get("type") == "ComplexItem":
            parts = simple_entries(entry)
            complex_places[index] = (len(entries), len(entries) + len(parts))
            entries += parts
        else:
            entries.append(entry)
    return entries, complex_places


def _rows(plan: Plan, jump_ids: list[int], others: Sequence[Mapping[str, Any]], name: str) -> list[dict[str, Any]]:
    """The items as objects of a file; a complex item that is still whole is one of them."""
    whole, rows, seq = places(plan.complex_items, plan.items), [], 0
    while seq < len(plan.items):
        count = len(whole[seq].items) if seq in whole else 1
        if seq in whole:
            rows.append(renumbered(whole[seq], jump_ids[seq : seq + count]))
        else:
            rows.append(_entry(plan.items[seq], seq, jump_ids, others[seq], name))
        seq += count
    return rows


def _seq_by_jump_id(entries: list[JsonTable]) -> dict[int, int]:
    """Mission item number of each doJumpId; an item without one has its own number if that is free."""
    seqs: dict[int, int] = {}
    for seq, entry in enumerate(entries):
        if "doJumpId" not in entry.values:
            continue
        number = entry.whole("doJumpId")
        if number in seqs:
            raise entry.error("doJumpId", f"{number} is also that of item {seqs[number]}")
        seqs[number] = seq
    for seq, entry in enumerate(entries):
        if "doJumpId" not in entry.values:
            seqs.setdefault(seq + 1, seq)
    return seqs


def _item(entry: JsonTable, seqs: Mapping[int, int]) -> MissionItem:
    kind = entry.values.get("type")
    if kind != "SimpleItem":
        raise entry.error("type", f"{str(kind)[:40]!r} is neither a SimpleItem nor a ComplexItem")
    command, frame = entry.whole("command"), entry.whole("frame")
    values = entry.numbers("params", 7)
    if command == DO_JUMP:
        if values[0] not in seqs:
            raise entry.error("params[0]", f"no item has the doJumpId {values[0]:g} to jump to")
        values[0] = float(seqs[int(values[0])])
    try:
        return item_from_values(command, frame, values, autocontinue=entry.flag("autoContinue", default=True))
    except LocalProtocolError as error:
        raise FileError(f"{entry.place}: {error}") from error


def _item_keys(entries: list[JsonTable]) -> tuple[dict[str, Any], ...]:
    keys = tuple(entry.others(_ITEM_KEYS) for entry in entries)
    for seq, (entry, others) in enumerate(zip(entries, keys, strict=True), 1):
        if entry.values.get("doJumpId", seq) != seq:
            others["doJumpId"] = entry.values["doJumpId"]
    return keys if any(keys) else ()


def _entry(item: MissionItem, seq: int, jump_ids: list[int], keys: Mapping[str, Any], name: str) -> dict[str, Any]:
    try:
        values = values_of(item)
    except LocalProtocolError as error:
        raise FileError(f"{name}: item {seq}: {error}") from error
    if item.command == DO_JUMP:
        if not 0.0 <= values[0] < len(jump_ids) or values[0] != int(values[0]):
            raise FileError(f"{name}: item {seq}: jumps to item {values[0]:g} of {len(jump_ids)}")
        values[0] = jump_ids[int(values[0])]
    return {
        **keys,
        "type": "SimpleItem",
        "command": item.command,
        "frame": item.frame,
        "params": [None if math.isnan(value) else value for value in values],
        "autoContinue": item.autocontinue,
        "doJumpId": jump_ids[seq],
    }


def _home(mission: JsonTable) -> Geodetic | None:
    if mission.values.get("plannedHomePosition") is None:
        return None
    lat, lon, alt = mission.numbers("plannedHomePosition", 3)
    if not (abs(lat) <= 90.0 and abs(lon) <= 180.0 and math.isfinite(alt)):
        raise mission.error("plannedHomePosition", f"{lat:g}, {lon:g}, {alt:g} is not on the globe")
    return Geodetic(lat, lon, alt)
