"""Items of missions, fences and rally plans at places in world NWU."""

import math

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.plans.plan import MissionItem
from sitl.defaults import HOME

NAN = math.nan
LOCAL = mavlink.MAV_FRAME_LOCAL_NED
FRAME = LocalFrame(HOME)
SQUARE = ((-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0))


def item(command, north=0.0, west=0.0, up=0.0, params=(0.0, 0.0, 0.0, NAN), frame=LOCAL):
    """An item at a place in world NWU [m]."""
    return MissionItem(command=command, frame=frame, params=params, x=round(north * 1e4), y=round(-west * 1e4), z=-up)


def waypoint(north, west, up, *, hold=0.0, radius=0.0):
    """A waypoint; with a radius it is flown over."""
    return item(mavlink.MAV_CMD_NAV_WAYPOINT, north, west, up, (hold, radius, 0.0, NAN))


TAKE_OFF = item(mavlink.MAV_CMD_NAV_TAKEOFF, up=3.0)
LAND = item(mavlink.MAV_CMD_NAV_LAND, frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT)  # latitude and longitude 0: here


def global_item(command, north, west, first=0.0, *, frame=0, z=0.0):
    """An item of a fence or rally plan, whose place is latitude and longitude; ``first`` is its first parameter."""
    here = FRAME.to_geodetic((north, -west, 0.0))
    return MissionItem(
        command=command,
        frame=frame,
        params=(first, 0.0, 0.0, 0.0),
        x=round(here.lat_deg * 1e7),
        y=round(here.lon_deg * 1e7),
        z=z,
    )


def polygon(corners=SQUARE, command=mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION):
    """The items of a fence that is one polygon."""
    return [global_item(command, north, west, float(len(corners))) for north, west in corners]
