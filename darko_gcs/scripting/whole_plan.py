"""The plan file of what a vehicle holds, as QGroundControl saves a plan that it has read from one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from darko_gcs.errors import FlightError
from darko_gcs.state.missions.plan_parts import FENCE, MISSION, RALLY, Items
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import counted
from protocol.errors import LocalProtocolError
from protocol.frames import Geodetic
from protocol.plans import Plan, save
from protocol.plans.fence_rally import fence_items, rally_items, with_fence, with_rally


def whole_plan(s: Snapshot, parts: Mapping[int, Items], home: Geodetic | None) -> Plan:
    """The plan of a vehicle's parts.

    Args:
        s: What is known of it.
        parts: Its items, by MAV_MISSION_TYPE.
        home: Where it is, if that is known.

    Raises:
        FlightError: Its fence or rally points cannot be part of a plan.
    """
    keys = {"firmwareType": s.autopilot, "vehicleType": s.kind}
    plan = Plan(items=parts[MISSION], planned_home=home, mission_keys=keys)
    try:
        return with_rally(with_fence(plan, parts.get(FENCE, ())), parts.get(RALLY, ()))
    except LocalProtocolError as error:
        raise FlightError(f"download: the vehicle's fence or rally points make no plan: {error}") from error


def save_downloaded(plan: Plan, path: Path) -> list[str]:
    """Write a plan; gives what is not in the file, in words: a file of waypoints has no fence and no rally points.

    Raises:
        FileError: It cannot be written.
    """
    left_out = []
    if path.suffix in {".waypoints", ".txt"}:
        parts = ((len(fence_items(plan)), "fence item"), (len(rally_items(plan)), "rally point"))
        left_out = [f"{counted(count, what)}, which only a .plan holds" for count, what in parts if count]
        empty = Plan()
        plan = replace(plan, geo_fence=empty.geo_fence, rally_points=empty.rally_points)
    if plan.planned_home is None:
        left_out.append("home, which the vehicle has not told: QGroundControl does not load a .plan without it")
    save(plan, path)
    return left_out
