"""Messages of the DARKO dialect about the flight plan: its table, where it is, and what happened in it.

The endpoint completes them (:class:`~protocol.engines.server.flight_plan_server.FlightPlanServer`): a plan's id, the
place of an entry in the table, the number of an event.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from protocol import units
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import PlanAim, PlanEventKind
from protocol.errors import LocalProtocolError
from protocol.flight_plans.flight_plan import FlightPlan, PlanSector
from protocol.frames import Geodetic
from protocol.plans.plan import MissionItem
from protocol.wire.message import Message
from sitl.autopilot.flight_plan.aims import (
    AimKind,
    BlockButton,
    BlockEntered,
    ExceptionFired,
    NamedWaypoint,
    PlanEvent,
    PlanRemark,
    PresentLeg,
    VariableSetting,
    WaypointMoved,
)
from sitl.autopilot.flight_plans import FlightPlanRequests
from sitl.mavlink.telemetry.streams import StreamTable
from sitl.mavlink.telemetry.vehicle_snapshot import VehicleSnapshot

MAX_CORNERS = 60  # of DARKO_PLAN_SECTOR; further ones are left out
MAX_FLOAT = 3e38  # of a float32, nearly
LEG_FRAME = mavlink.MAV_FRAME_GLOBAL

PLAN_STREAMS = StreamTable()


@PLAN_STREAMS.sends(mavlink.MAVLINK_MSG_ID_DARKO_PLAN_STATUS, 4.0)
def plan_status(s: VehicleSnapshot) -> list[Message]:
    """DARKO_PLAN_STATUS; none without a plan."""
    status = s.flight_plan
    if status is None:
        return []
    return [
        mavlink.MAVLink_darko_plan_status_message(
            time_boot_ms=s.ms,
            plan_id=0,
            checksum=0,
            block_time=status.block_time,
            stage_time=status.stage_time,
            flight_time=status.flight_time,
            entries=0,
            events=0,
            block=status.block,
            stage=status.stage,
            line=status.line,
            aim=PlanAim[status.aim.name],
            name=ascii_text(s.plan_name, 50),
            stage_text=ascii_text(status.stage_text, 120),
        )
    ]


def table_entries(requests: FlightPlanRequests) -> list[Message]:
    """Blocks, waypoints, variables and sectors of the plan that is loaded."""
    if requests.executor is None:
        return []
    plan = requests.executor.plan
    numbers = {point.name: number for number, point in enumerate(plan.waypoints, 1)}
    sectors = [sector for sector in plan.sectors if isinstance(sector, PlanSector)]
    return [
        *(_block(block) for block in requests.blocks()),
        *changing_entries(requests),
        *(_sector(plan, sector, number, numbers) for number, sector in enumerate(sectors, 1)),
    ]


def changing_entries(requests: FlightPlanRequests) -> list[Message]:
    """Waypoints and variables as they are now."""
    variables = enumerate(requests.variables(), 1)
    return [*map(_waypoint, requests.waypoints()), *(_variable(number, variable) for number, variable in variables)]


def _block(block: BlockButton) -> Message:
    return mavlink.MAVLink_darko_plan_block_message(
        plan_id=0,
        entry=0,
        number=block.number,
        name=ascii_text(block.name, 50),
        strip_button=ascii_text(block.strip_button, 40),
        shortcut=ascii_text(block.key, 16),
        group=ascii_text(block.group, 30),
        locked=ascii_text(block.locked, 100),
    )


def _waypoint(point: NamedWaypoint) -> Message:
    try:
        lat, lon = units.to_e7(point.place.lat_deg), units.to_e7(point.place.lon_deg)
    except LocalProtocolError:  # a plan may put a waypoint anywhere
        lat = lon = units.UNKNOWN_INT32
    x, y, z = (_float32(part) for part in point.position)
    return mavlink.MAVLink_darko_plan_waypoint_message(
        plan_id=0,
        lat=lat,
        lon=lon,
        alt=_float32(point.place.alt),
        x=x,
        y=y,
        z=z,
        entry=0,
        number=point.number,
        shown=int(point.is_shown),
        name=ascii_text(point.name, 50),
    )


def _variable(number: int, variable: VariableSetting) -> Message:
    return mavlink.MAVLink_darko_plan_variable_message(
        plan_id=0,
        value=_float32(variable.value),
        minimum=_float32(variable.low),
        maximum=_float32(variable.high),
        step=_float32(variable.step),
        entry=0,
        number=number,
        name=ascii_text(variable.name, 50),
        label=ascii_text(variable.label, 40),
        unit=ascii_text(variable.unit, 16),
    )


def _sector(plan: FlightPlan, sector: PlanSector, number: int, numbers: Mapping[str, int]) -> Message:
    points = [plan.waypoint(corner.name) for corner in sector.corners]
    corners = [numbers[point.name] for point in points if point is not None][:MAX_CORNERS]
    is_fence = plan.geofence_sector is not None and plan.geofence_sector.name == sector.name
    return mavlink.MAVLink_darko_plan_sector_message(
        plan_id=0,
        entry=0,
        number=number,
        corners=corners + [0] * (MAX_CORNERS - len(corners)),
        fence=int(is_fence),
        name=ascii_text(sector.name, 50),
    )


def plan_event(event: PlanEvent, blocks: Mapping[str, int]) -> Message | None:
    """DARKO_PLAN_EVENT; None for an event that the table tells.

    Args:
        event: What happened.
        blocks: Numbers of the blocks by name.
    """
    told: tuple[PlanEventKind, str, int, int, int]
    match event:
        case ExceptionFired(_, text, line, source, target, values):
            text = f"{text} [{values}]" if values else text
            told = PlanEventKind.EXCEPTION, text, line, blocks.get(source, 0), blocks.get(target, 0)
        case BlockEntered(_, number, name, cause, line):
            told = PlanEventKind.BLOCK, f"{name}: {cause}" if cause else name, line, number, number
        case PlanRemark(_, text):
            told = PlanEventKind.REMARK, text, 0, 0, 0
        case WaypointMoved():
            return None
    kind, text, line, from_block, to_block = told
    return mavlink.MAVLink_darko_plan_event_message(
        time_usec=units.microseconds(event.time),
        plan_id=0,
        number=0,
        line=min(line, 0xFFFF),
        from_block=from_block,
        to_block=to_block,
        kind=kind,
        text=ascii_text(text, 150),
    )


def leg_items(leg: PresentLeg | None) -> tuple[MissionItem, ...]:
    """Mission items of the leg that a plan flies now: a circle, a leg from its start to its end, or a point."""
    if leg is None:
        return ()
    if leg.kind is AimKind.ARC:
        return (_leg_item(mavlink.MAV_CMD_NAV_LOITER_UNLIM, leg.end, leg.radius),)
    ends = (leg.start, leg.end) if leg.kind is AimKind.LEG else (leg.end,)
    return tuple(_leg_item(mavlink.MAV_CMD_NAV_WAYPOINT, end) for end in ends)


def _leg_item(command: int, place: Geodetic, radius: float = 0.0) -> MissionItem:
    return MissionItem(
        command=command,
        frame=LEG_FRAME,
        params=(0.0, 0.0, _float32(radius), math.nan),
        x=units.to_e7(place.lat_deg),
        y=units.to_e7(place.lon_deg),
        z=round(place.alt, 2),
    )


def ascii_text(text: str | None, size: int) -> bytes:
    """A text as it fits a field of so many bytes."""
    return (text or "").encode("ascii", errors="replace")[:size]


def _float32(value: float | None) -> float:
    """A number that fits the wire; NaN for none."""
    if value is None or math.isnan(value):
        return math.nan
    return min(max(float(value), -MAX_FLOAT), MAX_FLOAT)
