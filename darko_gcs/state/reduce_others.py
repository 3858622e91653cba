"""Messages that other autopilots send where DarkO sends another one: their handlers."""

from __future__ import annotations

import math

from darko_gcs.state.message_handlers import HandlerTable
from darko_gcs.state.missions.plan_parts import plan_of, with_plan
from darko_gcs.state.places import is_on_map
from darko_gcs.state.snapshot import Snapshot, updated
from protocol import units
from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError
from protocol.frames import Geodetic
from protocol.mav_frames import ABSOLUTE_ALTITUDE_FRAMES
from protocol.plans import MissionItem
from protocol.wire.message import Message

__all__ = ["OTHER_HANDLERS", "mission_item"]

NO_POSITION = (
    mavlink.POSITION_TARGET_TYPEMASK_X_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_Y_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_Z_IGNORE
)
OTHER_HANDLERS = HandlerTable()


@OTHER_HANDLERS.handles("WIND")
def _wind(s: Snapshot, m: Message, _now: float) -> Snapshot:
    """ArduPilot's wind: where it comes from, its speed, and the share of it that blows down."""
    level = math.sqrt(max(m.speed**2 - m.speed_z**2, 0.0))
    course = math.radians(m.direction + 180.0)
    return updated(s, wind=(level * math.cos(course), level * math.sin(course), m.speed_z))


@OTHER_HANDLERS.handles("POSITION_TARGET_GLOBAL_INT")
def _global_target(s: Snapshot, m: Message, _now: float) -> Snapshot:
    """ArduPilot's target; without a place above mean sea level there is none to show."""
    is_place = m.coordinate_frame in ABSOLUTE_ALTITUDE_FRAMES and not m.type_mask & NO_POSITION
    if not is_place or not is_on_map(m.lat_int, m.lon_int):
        return updated(s, target_place=None)
    return updated(s, target_place=Geodetic(units.from_e7(m.lat_int), units.from_e7(m.lon_int), m.alt))


@OTHER_HANDLERS.handles("MISSION_ITEM")
def _float_mission_item(s: Snapshot, m: Message, now: float) -> Snapshot:
    """An item of the mission in the older message, with its place in floats."""
    try:
        return mission_item(s, m, now)
    except LocalProtocolError:  # its floats are no place
        return s


def mission_item(s: Snapshot, m: Message, _now: float) -> Snapshot:
    """The snapshot with an item of a plan.

    Raises:
        LocalProtocolError: The floats of a MISSION_ITEM are not a place.
    """
    items = plan_of(s, m.mission_type)
    if items is None or m.seq > len(items):
        return s
    return with_plan(s, m.mission_type, (*items[: m.seq], MissionItem.from_message(m), *items[m.seq + 1 :]))
