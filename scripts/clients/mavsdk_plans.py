"""The missions that ``mavsdk_session.py`` uploads and flies."""

from __future__ import annotations

import math
import struct
from typing import Any

from mavsdk.plugins.mission import MissionItem
from mavsdk.plugins.mission_raw import MissionItem as RawItem

METRE = math.degrees(1.0 / 6371008.8)  # of latitude [deg]


def forward_plan(lat: float, lon: float) -> list[Any]:
    """Take-off, a leg in forward flight, a corner and back to the hover, as MAVSDK's own items."""
    east = METRE / math.cos(math.radians(lat))

    def at(north: float, right: float, up: float, action: Any, *, through: bool = False) -> Any:  # noqa: ANN401
        return MissionItem(
            lat + north * METRE, lon + right * east, up, 3.0, through, acceptance_radius_m=1.0, vehicle_action=action
        )

    act = MissionItem.VehicleAction
    return [
        at(0.0, 0.0, 12.0, act.TAKEOFF),
        at(5.0, 0.0, 12.0, act.TRANSITION_TO_FW),
        at(110.0, 0.0, 12.0, act.NONE),
        at(110.0, 70.0, 12.0, act.TRANSITION_TO_MC),
        at(110.0, 75.0, 12.0, act.NONE),
    ]


def raw_plan(lat: float, lon: float) -> list[Any]:
    """Items with NaN, negative zero and numbers without a short decimal form: every bit must come back."""
    spots = [(22, math.nan, math.nan), (16, 1.0 / 3.0, math.pi), (16, 0.1, math.nan), (21, -0.0, math.nan)]
    return [
        RawItem(
            seq, 6, command, int(seq == 0), 1, hold, 0.7, -0.0 if command == 16 else math.nan, yaw,
            round(lat * 1e7) + seq, round(lon * 1e7) - 3 * seq, 0.0 if command == 21 else 10.0 / 3.0 + seq, 0,
        )
        for seq, (command, hold, yaw) in enumerate(spots)
    ]  # fmt: skip


def bits(item: Any) -> tuple[Any, ...]:  # noqa: ANN401
    """A raw item as values that compare bit for bit."""
    floats = struct.pack("<5f", item.param1, item.param2, item.param3, item.param4, item.z)
    return (item.seq, item.frame, item.command, item.autocontinue, floats, item.x, item.y)


def distance(here: Any, there: Any) -> float:  # noqa: ANN401
    """Between two positions of the telemetry that are near each other, over the ground [m]."""
    east = math.cos(math.radians(there.latitude_deg)) * (here.longitude_deg - there.longitude_deg)
    return math.hypot(here.latitude_deg - there.latitude_deg, east) / METRE
