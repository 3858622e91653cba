"""The older waypoint files, "QGC WPL 110" and "120" (https://mavlink.io/en/file_formats/#mission_plain_text_file).

One row per item, with columns separated by tabs: index, current, frame, command, param1..param4, x, y, z,
autocontinue. Row 0 is not an item but the home position, as in QGroundControl and MAVProxy; zeros there mean that no
home is planned. In version 120, which is only read, row 0 is the first item, and no home is planned. The format has no
speeds, fence and rally points.
"""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.frames import Geodetic
from protocol.plans.item_values import DO_JUMP, item_from_values, values_of
from protocol.plans.plan import MissionItem, Plan

HEADER = "QGC WPL"
_VERSION = "110"
_FIRST_ITEM_ROWS = {_VERSION: 1, "120": 0}  # by version
_COLUMNS = (
    *("index", "current", "frame", "command", "param1", "param2", "param3", "param4"),
    *("x (latitude)", "y (longitude)", "z (altitude)", "autocontinue"),
)


def parse(text: str, name: str) -> Plan:
    """A plan from the text of a file called ``name``.

    Raises:
        FileError: It is not valid; the message names the line, the column and the value.
    """
    lines = text.splitlines()
    version = lines[0].removeprefix(HEADER).strip()
    if version not in _FIRST_ITEM_ROWS:
        known = " or ".join(f"'{HEADER} {number}'" for number in _FIRST_ITEM_ROWS)
        raise FileError(f"{name}:1: {lines[0]!r} is not {known}")
    first = _FIRST_ITEM_ROWS[version]
    rows = [
        (f"{name}:{number}", line.split())
        for number, line in enumerate(lines[1:], 2)
        if line.strip() and not line.startswith("#")
    ]
    if not rows:
        return Plan()
    home = _home(_numbers(rows[0][1], 0, rows[0][0]), rows[0][0]) if first else None
    seqs = range(first, len(rows))
    items = tuple(_item(rows[index][1], index, seqs, rows[index][0]) for index in seqs)
    return Plan(items=items, planned_home=home)


def render(plan: Plan, name: str) -> str:
    """The text of a waypoint file; speeds are left out.

    Raises:
        FileError: The plan holds a fence or rally points, or an item that cannot be written.
    """
    if plan.geo_fence.get("circles") or plan.geo_fence.get("polygons") or plan.rally_points.get("points"):
        raise FileError(f"{name}: a waypoint file cannot carry the plan's fence and rally points: save it as .plan")
    home = plan.planned_home or Geodetic(0.0, 0.0, 0.0)
    head = [0, 1, mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_CMD_NAV_WAYPOINT]
    rows = [_row(head, [0.0, 0.0, 0.0, 0.0, home.lat_deg, home.lon_deg, home.alt], autocontinue=True)]
    for index, item in enumerate(plan.items, 1):
        try:
            values = values_of(item)
        except LocalProtocolError as error:
            raise FileError(f"{name}: item {index - 1}: {error}") from error
        if item.command == DO_JUMP:
            values[0] = _row_of(values[0], len(plan.items), f"{name}: item {index - 1}")
        head = [index, int(item.current), item.frame, item.command]
        rows.append(_row(head, values, autocontinue=item.autocontinue))
    return "\n".join((f"{HEADER} {_VERSION}", *rows, ""))


def _row(head: list[int], values: list[float], *, autocontinue: bool) -> str:
    return "\t".join((*map(str, head), *map(_decimal, values), str(int(autocontinue))))


def _decimal(value: float) -> str:
    """Eight decimals, as other tools write; more if needed for the exact value."""
    text = f"{value:.8f}"
    return text if float(text) == value or math.isnan(value) else repr(value)


def _row_of(target: float, count: int, place: str) -> float:
    """Row of the target of a DO_JUMP: rows include the home position."""
    if not 0.0 <= target < count or target != int(target):
        raise FileError(f"{place}: jumps to item {target:g} of {count}")
    return target + 1.0


def _home(values: list[float], place: str) -> Geodetic | None:
    if values[3] != mavlink.MAV_CMD_NAV_WAYPOINT:
        raise FileError(f"{place}: row 0 is the home position, a waypoint (command 16), not command {values[3]:g}")
    lat, lon, alt = values[8:11]
    if not (abs(lat) <= 90.0 and abs(lon) <= 180.0 and math.isfinite(alt)):
        raise FileError(f"{place}: home {lat:g}, {lon:g}, {alt:g} is not on the globe")
    return Geodetic(lat, lon, alt) if lat or lon or alt else None


def _item(row: list[str], index: int, seqs: range, place: str) -> MissionItem:
    values = _numbers(row, index, place)
    current, frame, command, autocontinue = (_whole(values[column], column, place) for column in (1, 2, 3, 11))
    if command == DO_JUMP:
        if values[4] not in seqs:
            raise FileError(f"{place}: jumps to row {values[4]:g}; the items are rows {seqs[0]}..{seqs[-1]}")
        values[4] -= seqs[0]
    try:
        return item_from_values(command, frame, values[4:11], autocontinue=bool(autocontinue), current=bool(current))
    except LocalProtocolError as error:
        raise FileError(f"{place}: {error}") from error


def _numbers(row: list[str], index: int, place: str) -> list[float]:
    if len(row) != len(_COLUMNS):
        raise FileError(f"{place}: {len(row)} columns, not {len(_COLUMNS)}")
    values = []
    for column, text in enumerate(row):
        try:
            values.append(float(text))
        except ValueError:
            raise FileError(f"{place}: {_COLUMNS[column]} is {text!r}, not a number") from None
    if values[0] != index:
        raise FileError(f"{place}: index {row[0]} where {index} was expected")
    return values


def _whole(value: float, column: int, place: str) -> int:
    if not 0.0 <= value <= 0xFFFF or value != int(value):
        raise FileError(f"{place}: {_COLUMNS[column]} is {value:g}, not a whole number from 0 to 65535")
    return int(value)
