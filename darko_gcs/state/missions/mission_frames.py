"""A mission item in another frame: the same place, in other numbers."""

from __future__ import annotations

import math
from dataclasses import replace

from protocol.dialect import mavlink
from protocol.frames import (
    ABSOLUTE_ALTITUDE_FRAMES,
    RELATIVE_ALTITUDE_FRAMES,
    Geodetic,
    LocalFrame,
    Vector,
    is_global_frame,
)
from protocol.plans import MissionItem
from protocol.units import UNKNOWN_INT32, from_e7, from_local_e4, local_e4, to_e7

LOCAL_FRAMES = frozenset({mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_LOCAL_ENU})
FAMILIES = (ABSOLUTE_ALTITUDE_FRAMES, RELATIVE_ALTITUDE_FRAMES)  # frames in one of them have the same numbers


def in_frame(item: MissionItem, frame: int, home: Geodetic | None, home_p: Vector = (0.0, 0.0, 0.0)) -> MissionItem:
    """The item at the same place, with its numbers in another frame.

    Args:
        item: The item before.
        frame: MAV_FRAME.
        home: None while it is not known.
        home_p: Home in the local frame, NED [m].

    Raises:
        ValueError: The numbers cannot be converted; the message says why.
        LocalProtocolError: The place does not fit the wire.
    """
    if frame == item.frame or any({frame, item.frame} <= family for family in FAMILIES):
        return replace(item, frame=frame)
    if home is None:
        raise ValueError("Frame: home is not known yet, and without it the numbers cannot be converted")
    if {frame, item.frame} <= ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES:
        return replace(item, frame=frame, z=item.z + (home.alt if frame in ABSOLUTE_ALTITUDE_FRAMES else -home.alt))
    if UNKNOWN_INT32 in {item.x, item.y} or math.isnan(item.z):
        raise ValueError("Frame: the item leaves its place to the vehicle: there is nothing to convert")
    return _placed(item, frame, _place(item, home, home_p), home, home_p)


def place_of(item: MissionItem, home: Geodetic, home_p: Vector = (0.0, 0.0, 0.0)) -> Vector | None:
    """Position of an item, NED in the vehicle's local frame [m]; None if it has no place of its own.

    Args:
        item: The item.
        home: The vehicle's home.
        home_p: Home in the local frame, NED [m].
    """
    is_open = UNKNOWN_INT32 in {item.x, item.y} or math.isnan(item.z)
    is_unset = is_global_frame(item.frame) and item.x == item.y == 0
    known = ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES | LOCAL_FRAMES
    if item.frame not in known or is_open or is_unset:
        return None
    north, east, down = LocalFrame(home).to_ned(_place(item, home, home_p))
    return north + home_p[0], east + home_p[1], down + home_p[2]


def shifted(item: MissionItem, by: Vector, home: Geodetic, home_p: Vector = (0.0, 0.0, 0.0)) -> MissionItem:
    """The item so far away from where it was, in its own frame.

    Args:
        item: The item.
        by: North, east and up [m].
        home: The vehicle's home.
        home_p: Home in the local frame, NED [m].

    Raises:
        ValueError: The item has no place of its own.
        LocalProtocolError: The new place does not fit the wire.
    """
    if place_of(item, home, home_p) is None:
        raise ValueError("The item has no place of its own to be moved from")
    north, east, down = LocalFrame(home).to_ned(_place(item, home, home_p))
    place = LocalFrame(home).to_geodetic((north + by[0], east + by[1], down - by[2]))
    new = _placed(item, item.frame, place, home, home_p)
    return new if by[2] else replace(new, z=item.z)


def _place(item: MissionItem, home: Geodetic, home_p: Vector) -> Geodetic:
    if item.frame in ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES:
        above = home.alt if item.frame in RELATIVE_ALTITUDE_FRAMES else 0.0
        return Geodetic(from_e7(item.x), from_e7(item.y), item.z + above)
    if item.frame not in LOCAL_FRAMES:
        raise ValueError(f"Frame: numbers of MAV_FRAME {item.frame} cannot be converted")
    x, y = from_local_e4(item.x), from_local_e4(item.y)
    north, east, down = (x, y, item.z) if item.frame == mavlink.MAV_FRAME_LOCAL_NED else (y, x, -item.z)
    return LocalFrame(home).to_geodetic((north - home_p[0], east - home_p[1], down - home_p[2]))


def _placed(item: MissionItem, frame: int, place: Geodetic, home: Geodetic, home_p: Vector) -> MissionItem:
    if frame in ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES:
        z = place.alt - (home.alt if frame in RELATIVE_ALTITUDE_FRAMES else 0.0)
        return replace(item, frame=frame, x=to_e7(place.lat_deg), y=to_e7(place.lon_deg), z=z)
    if frame not in LOCAL_FRAMES or is_global_frame(frame):
        raise ValueError(f"Frame: the numbers cannot be converted to MAV_FRAME {frame}")
    own = LocalFrame(home).to_ned(place)
    north, east, down = (part + offset for part, offset in zip(own, home_p, strict=True))
    if frame == mavlink.MAV_FRAME_LOCAL_NED:
        return replace(item, frame=frame, x=local_e4(north), y=local_e4(east), z=down)
    return replace(item, frame=frame, x=local_e4(east), y=local_e4(north), z=-down)
