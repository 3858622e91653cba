"""The older waypoint file, "QGC WPL 110" (https://mavlink.io/en/file_formats/#mission_plain_text_file).

A line per item, tab-separated: index, current, frame, command, param1..param4, x, y, z, autocontinue. Item 0 is the
home position by convention, not part of the mission.
"""

from __future__ import annotations

import math

from protocol import units
from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.frames import Geodetic
from protocol.plans.mission import MissionItem
from protocol.plans.plan import Plan

__all__ = ["HEADER", "parse", "render"]

HEADER = "QGC WPL"
VERSION = "110"
COLUMNS = 12


def parse(text: str, name: str) -> Plan:
    """A plan from the text of a file called ``name``.

    Raises:
        FileError: If it is not valid; the message names the line.
    """
    lines = text.splitlines()
    if lines[0].split() != [*HEADER.split(), VERSION]:
        raise FileError(f"{name}:1: {lines[0]!r} is not '{HEADER} {VERSION}'")
    rows = [(number, line.split("\t")) for number, line in enumerate(lines[1:], 2) if line.strip()]
    items = [_item(row, index, f"{name}:{number}") for index, (number, row) in enumerate(rows)]
    if not items:
        return Plan()
    home = items[0]
    if not units.is_global_frame(home.frame):
        raise FileError(f"{name}:{rows[0][0]}: the first item is the home position and must be in a global frame")
    return Plan(items=tuple(items[1:]), planned_home=Geodetic(home.x * 1e-7, home.y * 1e-7, home.z))


def render(plan: Plan, name: str) -> str:
    """The text of a waypoint file.

    Raises:
        FileError: If the plan holds a fence or rally points, which this format cannot carry.
    """
    if plan.geo_fence.get("circles") or plan.geo_fence.get("polygons") or plan.rally_points.get("points"):
        raise FileError(f"{name}: a waypoint file cannot carry the plan's fence and rally points: save it as .plan")
    home = plan.planned_home or Geodetic(0.0, 0.0, 0.0)
    first = MissionItem(
        mavlink.MAV_CMD_NAV_WAYPOINT,
        mavlink.MAV_FRAME_GLOBAL,
        (0.0, 0.0, 0.0, 0.0),
        units.to_e7(home.lat_deg),
        units.to_e7(home.lon_deg),
        home.alt,
    )
    lines = [f"{HEADER} {VERSION}"]
    lines += [_line(item, index) for index, item in enumerate((first, *plan.items))]
    return "\n".join(lines) + "\n"


def _line(item: MissionItem, index: int) -> str:
    scale = units.from_e7 if units.is_global_frame(item.frame) else units.from_local_e4
    digits = 8 if units.is_global_frame(item.frame) else 4
    params = list(item.params)
    if item.command == mavlink.MAV_CMD_DO_JUMP:
        params[0] += 1  # files count the home position
    numbers = [
        *(f"{value!r}" for value in params),
        *(f"{scale(v):.{digits}f}" for v in (item.x, item.y)),
        f"{item.z!r}",
    ]
    row = [str(index), str(int(index == 0)), str(item.frame), str(item.command), *numbers, str(int(item.autocontinue))]
    return "\t".join(row)


def _item(row: list[str], index: int, where: str) -> MissionItem:
    if len(row) != COLUMNS:
        raise FileError(f"{where}: {len(row)} columns, not {COLUMNS} separated by tabs")
    values = [_number(text, column, where) for column, text in enumerate(row, 1)]
    whole = [_whole(values[column], column + 1, where) for column in (0, 2, 3)]
    if whole[0] != index:
        raise FileError(f"{where}: index {whole[0]} where {index} was expected")
    frame, command = whole[1:]
    if units.is_global_frame(frame) and not (abs(values[8]) <= 90.0 and abs(values[9]) <= 180.0):
        raise FileError(f"{where}: position {values[8]:g}, {values[9]:g} is not on the globe")
    scale = units.to_e7 if units.is_global_frame(frame) else units.local_e4
    if command == mavlink.MAV_CMD_DO_JUMP:
        values[4] -= 1
    try:
        x, y = scale(values[8]), scale(values[9])
        first = (values[4], values[5], values[6], values[7])
        return MissionItem(command, frame, first, x, y, values[10], bool(values[11]))
    except LocalProtocolError as error:
        raise FileError(f"{where}: {error}") from error


def _number(text: str, column: int, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise FileError(f"{where}: column {column} is {text!r}, not a number") from None
    if math.isinf(value):
        raise FileError(f"{where}: column {column} is infinite")
    return value


def _whole(value: float, column: int, where: str) -> int:
    if math.isnan(value) or value != int(value) or not 0 <= value <= 0xFFFF:
        raise FileError(f"{where}: column {column} is {value:g}, not a whole number from 0 to 65535")
    return int(value)
