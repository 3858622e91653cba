"""The seven numbers of an item in plan files, and which values are valid.

Both formats have latitude and longitude in degrees, local coordinates in metres, and the numbers of items in
MAV_FRAME_MISSION as on the wire. NaN means "default": in a position it is INT32_MAX on the wire.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from protocol import units
from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError
from protocol.names import is_global_frame
from protocol.plans.plan import MissionItem
from protocol.ranges import ANY_NUMBER, KNOWN_FRAMES, LATITUDE, LONGITUDE

DO_JUMP = mavlink.MAV_CMD_DO_JUMP
_WITH_POSITION = {  # commands that need a position
    mavlink.MAV_CMD_NAV_WAYPOINT,
    mavlink.MAV_CMD_NAV_LOITER_UNLIM,
    mavlink.MAV_CMD_NAV_LOITER_TURNS,
    mavlink.MAV_CMD_NAV_LOITER_TIME,
    mavlink.MAV_CMD_NAV_LOITER_TO_ALT,
    mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT,
}
_GLOBAL_NAMES = ("param1", "param2", "param3", "param4", "latitude", "longitude", "altitude")
_LOCAL_NAMES = (*_GLOBAL_NAMES[:4], "x", "y", "z")


def item_from_values(
    command: int, frame: int, values: Sequence[float], *, autocontinue: bool, current: bool = False
) -> MissionItem:
    """The item with these seven numbers of a file; positions are rounded to the nearest step of the wire.

    Raises:
        LocalProtocolError: A number is not valid; the message names it and its value.
    """
    _check(command, frame, values)
    x, y = (_to_wire(frame, value) for value in values[4:6])
    params = (values[0], values[1], values[2], values[3])
    return MissionItem(
        command=command,
        frame=frame,
        params=params,
        x=x,
        y=y,
        z=values[6],
        autocontinue=autocontinue,
        current=current,
    )


def values_of(item: MissionItem) -> list[float]:
    """The seven numbers of an item; float32 values become the shortest decimals with the same value.

    Raises:
        LocalProtocolError: The item would be refused if the file were loaded again.
    """
    *params, x, y, z = numbers_of(item)
    values = [*map(_shortest, params), x, y, _shortest(z)]
    _check(item.command, item.frame, values)
    return values


def numbers_of(item: MissionItem) -> tuple[float, ...]:
    """The seven numbers of any item: degrees or metres, NaN where a position is left open."""
    return (*item.params, *(_from_wire(item.frame, number) for number in (item.x, item.y)), item.z)


def _check(command: int, frame: int, values: Sequence[float]) -> None:
    if frame not in KNOWN_FRAMES:
        raise LocalProtocolError(f"frame {frame} is not a MAV_FRAME")
    is_global = is_global_frame(frame)
    names = _GLOBAL_NAMES if is_global else _LOCAL_NAMES
    for name, value in zip(names, values, strict=True):
        if not ANY_NUMBER.allows(value):
            reason = "is infinite" if math.isinf(value) else f"{value:g} does not fit the wire"
            raise LocalProtocolError(f"{name} {reason}")
    if command in _WITH_POSITION:
        for name, value in zip(names[4:], values[4:], strict=True):
            if math.isnan(value):
                raise LocalProtocolError(f"{name} is missing, but command {command} needs a position")
    if is_global:
        for allowed, value in zip((LATITUDE, LONGITUDE), values[4:6], strict=True):
            if not allowed.allows(value):
                span = f"{allowed.minimum:g}..{allowed.maximum:g}"
                raise LocalProtocolError(f"{allowed.name} {value} is not in {span} deg")


def _to_wire(frame: int, value: float) -> int:
    if math.isnan(value):
        return units.UNKNOWN_INT32
    if frame != mavlink.MAV_FRAME_MISSION:
        return units.to_e7(value) if is_global_frame(frame) else units.local_e4(value)
    if value != int(value):
        raise LocalProtocolError(f"{value} is not a whole number, as x and y of frame {frame} must be")
    return int(value)


def _from_wire(frame: int, number: int) -> float:
    if number == units.UNKNOWN_INT32:
        return math.nan
    if frame == mavlink.MAV_FRAME_MISSION:
        return float(number)
    return units.from_e7(number) if is_global_frame(frame) else units.from_local_e4(number)


def _shortest(value: float) -> float:
    return float(str(np.float32(value)))
