"""Shared by the studies that fly missions: the world they fly in, waypoints, and the end of a mission."""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.plans.mission_item import MissionItem
from sitl import Aircraft
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME

STUDY_WORLD = World(LocalFrame(HOME), ARENAS["open"])
SAMPLE_PERIODS = 10  # control periods between two looks at a flight


def waypoint(north: float, west: float, up: float, hold: float = 0.0) -> MissionItem:
    """A waypoint in the local frame.

    Args:
        north: [m].
        west: [m].
        up: Above the origin [m].
        hold: Time to stay there [s].
    """
    params = (hold, 0.0, 0.0, math.nan)
    return MissionItem(
        command=mavlink.MAV_CMD_NAV_WAYPOINT,
        frame=mavlink.MAV_FRAME_LOCAL_NED,
        params=params,
        x=round(north * 1e4),
        y=round(-west * 1e4),
        z=-up,
    )


def has_finished_mission(aircraft: Aircraft) -> bool:
    """Whether the last item of its mission is done."""
    mission = aircraft.autopilot.mission
    return mission is not None and mission.finished
