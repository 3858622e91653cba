"""Home and the origin of the local frame: how they are moved, and which moves are refused.

Home is where a return lands (unless a rally point is nearer) and what relative altitudes are measured from. It may be
moved at any time, in flight as well. The origin is the position of the local frame on the globe. It may be moved on the
ground only; home then moves along, as the same position in that frame.
"""

from __future__ import annotations

import math
from typing import Protocol

from protocol.frames import Geodetic, LocalFrame
from protocol.names import Mode
from sitl.autopilot.answers import ACCEPTED, DENIED, REJECTED, Answer
from sitl.autopilot.mission.items import refuse_items
from sitl.autopilot.mission.runner import MissionRunner
from sitl.autopilot.safety.world import World
from sitl.control.reference import Point
from sitl.defaults import MAX_ORIGIN_ALTITUDE, MAX_ORIGIN_LATITUDE
from sitl.guidance.view import VehicleView

MAX_HOME_DEPTH = 10.0  # below the ground: altitudes from terrain data are no more accurate [m]


class Housed(Protocol):
    """The autopilot, as far as changes of home and origin need it."""

    @property
    def world(self) -> World:
        """The world in which it flies: arena, fence, rally points and home."""

    @property
    def view(self) -> VehicleView:
        """The vehicle at the last tick."""

    @property
    def mode(self) -> Mode:
        """The flight mode."""

    @property
    def mission(self) -> MissionRunner | None:
        """The mission that is loaded, None without one."""

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""

    @property
    def flying(self) -> bool:
        """Whether the vehicle is to be in the air."""

    def relocate(self, frame: LocalFrame, home: Point) -> None:
        """Put the world frame elsewhere on the globe, or home elsewhere in it, world NWU [m]."""


def move_home(autopilot: Housed, p: Point) -> Answer:
    """Move home to a point, world NWU [m]."""
    moved = autopilot.world._replace(home=p)
    reason = refuse_home(p, moved)
    if reason is None and autopilot.flying:
        reason = _refuse_in_flight(autopilot, moved)
    if reason is not None:
        return Answer(DENIED, f"Home denied: {reason}")
    autopilot.relocate(moved.frame, p)
    return Answer(ACCEPTED)


def move_home_to(autopilot: Housed, lat: float, lon: float, altitude: float, *, relative: bool) -> Answer:
    """Move home to a place on the globe.

    Args:
        autopilot: Whose home it is.
        lat: [deg].
        lon: [deg].
        altitude: Above the sea [m]; NaN leaves that of home as it is.
        relative: The altitude may also be above home. MAVSDK names a relative frame for altitudes above the sea: the
            meaning that is nearer to the ground is taken.
    """
    world = autopilot.world
    if reason := _refuse_position(lat, lon):
        return Answer(DENIED, f"Home denied: {reason}")
    if math.isnan(altitude):
        up = world.home[2]
    else:
        up = world.up(altitude, above_sea=True)
        if relative:
            up = min(up, world.up(altitude, above_sea=False), key=abs)
    return move_home(autopilot, world.local(lat, lon, up))


def refuse_home(p: Point, world: World) -> str | None:
    """The reason why home may not be at a point, world NWU [m], in a world; None if it may."""
    if p[2] < -MAX_HOME_DEPTH:
        return f"it would be {-p[2]:.1f} m under the ground"
    fence = world.fence._replace(home=p)
    outside = world.arena.refuse((p[0], p[1], max(p[2], 0.0)))
    breach = None if outside else fence.breach([p])
    return f"it would be {breach.text}" if breach is not None else outside


def _refuse_in_flight(autopilot: Housed, moved: World) -> str | None:
    """The reason why a flight cannot go on with home moved: outside its fence, or a mission it cannot fly; or None."""
    moved = moved._replace(fence=moved.fence._replace(home=moved.home))
    now, then = (world.fence.breach([autopilot.view.p]) for world in (autopilot.world, moved))
    if then is not None and now is None:
        return f"the vehicle would be {then.text}"
    if autopilot.mode is Mode.MISSION and autopilot.mission is not None:
        outside = refuse_items(autopilot.mission.items, moved)
        return None if outside is None else f"the mission under way could not be flown: {outside}"
    return None


def move_origin(autopilot: Housed, origin: Geodetic) -> Answer:
    """Put the origin of the local frame elsewhere; home stays where it is in that frame. Refused while armed."""
    if autopilot.armed:
        return Answer(REJECTED, "Origin refused: disarm first")
    if reason := refuse_origin(origin):
        return Answer(DENIED, f"Origin denied: {reason}")
    autopilot.relocate(LocalFrame(origin), autopilot.world.home)
    return Answer(ACCEPTED)


def refuse_origin(origin: Geodetic) -> str | None:
    """The reason why the origin may not be at a place; None if it may."""
    if reason := _refuse_position(origin.lat_deg, origin.lon_deg):
        return reason
    if abs(origin.lat_deg) > MAX_ORIGIN_LATITUDE:
        return f"latitude {origin.lat_deg:g} is too near a pole"
    if not abs(origin.alt) <= MAX_ORIGIN_ALTITUDE:
        return f"altitude {origin.alt:g} m is out of range (±{MAX_ORIGIN_ALTITUDE:g} m)"
    return None


def _refuse_position(lat: float, lon: float) -> str | None:
    if abs(lat) <= 90.0 and abs(lon) <= 180.0:  # neither holds of NaN
        return None
    return f"latitude {lat:g}, longitude {lon:g} is not a valid position"
