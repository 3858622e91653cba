"""The three plans that a vehicle holds, by MAV_MISSION_TYPE: mission, fence and rally points."""

from __future__ import annotations

from darko_gcs.state.snapshot import Snapshot, updated
from protocol.dialect import mavlink
from protocol.plans import MissionItem

MISSION: int = mavlink.MAV_MISSION_TYPE_MISSION
FENCE: int = mavlink.MAV_MISSION_TYPE_FENCE
RALLY: int = mavlink.MAV_MISSION_TYPE_RALLY
ALL_PLANS: int = mavlink.MAV_MISSION_TYPE_ALL
PLAN_TYPES = (MISSION, FENCE, RALLY)
PLAN_TITLES = {MISSION: "Mission", FENCE: "Fence", RALLY: "Rally plan", ALL_PLANS: "Mission, fence and rally plan"}

Items = tuple[MissionItem, ...]


def plan_of(s: Snapshot, plan_type: int) -> Items | None:
    """The vehicle's plan of one MAV_MISSION_TYPE; None for another type."""
    return {MISSION: s.mission, FENCE: s.fence, RALLY: s.rally}.get(plan_type)


def with_plan(s: Snapshot, plan_type: int, items: Items) -> Snapshot:
    """The snapshot with another plan of a MAV_MISSION_TYPE; with ALL_PLANS, of all three types."""
    if plan_type in {MISSION, ALL_PLANS}:
        s = updated(s, mission=items)
    if plan_type in {FENCE, ALL_PLANS}:
        s = updated(s, fence=items)
    if plan_type in {RALLY, ALL_PLANS}:
        s = updated(s, rally=items)
    return s
