"""Home and the origin of the local frame: how they are moved, which moves are refused, and what is kept of them.

Home is where a return lands (unless a rally point is nearer) and what relative altitudes are measured from; it may be
moved at any time, in flight as well. The origin is the place on the globe of the local frame; it may be moved on the
ground only, and home then moves along, as the same place in that frame.

https://mavlink.io/en/messages/common.html#MAV_CMD_DO_SET_HOME, #MAV_CMD_DO_SET_GLOBAL_ORIGIN (which supersedes
#SET_GPS_GLOBAL_ORIGIN) and #SET_HOME_POSITION, which old clients send.
"""

from __future__ import annotations

import math
from dataclasses import astuple

from protocol import units
from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.events import CommandRequested
from protocol.frames import Geodetic, LocalFrame, flip
from protocol.modes import Mode
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.bounds import Bounds
from sitl.autopilot.mission_items import GLOBAL_FRAMES, RELATIVE_FRAMES, World, out_of_bounds
from sitl.autopilot.outcome import ACCEPTED, DENIED, REJECTED, Notice, Outcome
from sitl.control.reference import Point
from sitl.memory import Anchors, Memory

UNSUPPORTED_FRAME = mavlink.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME
MOVES = frozenset({mavlink.MAV_CMD_DO_SET_HOME, mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN})
MESSAGES = frozenset({"SET_HOME_POSITION", "SET_GPS_GLOBAL_ORIGIN"})
HIGHEST = 10e3  # origin, above or below the sea [m]
NEAREST_POLE = 89.0  # latitude of an origin, as of ``--home`` [deg]
BELOW_GROUND = 10.0  # how far home may be: clients take altitudes from terrain data that are no better [m]
SAME_SITE = 100.0  # what was kept is used where the vehicle starts no farther from where it started then [m]


def set_home(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    """MAV_CMD_DO_SET_HOME: here (param1 1) or at a place; an altitude that is left open (NaN) stays as it is.

    Roll, pitch and yaw of the ground are not used: it is level, and no return turns to a heading.
    """
    here = request.params[0]
    if here == 1.0:
        return move_home(autopilot, autopilot.view.p)
    if math.isfinite(here) and here != 0.0:
        return Outcome(DENIED, f"Home denied: param1 is {here:g}, not 1 (here) or 0 (the place that is given)")
    if request.frame is not None and request.frame not in GLOBAL_FRAMES | RELATIVE_FRAMES:
        return Outcome(UNSUPPORTED_FRAME, f"Home denied: frame {request.frame} is not supported")
    return _set_home_at(autopilot, *request.params[4:7], is_relative=request.frame in RELATIVE_FRAMES)


def _set_home_at(autopilot: Autopilot, lat: float, lon: float, altitude: float, *, is_relative: bool) -> Outcome:
    world = autopilot.world
    if reason := _not_on_the_globe(lat, lon):
        return Outcome(DENIED, f"Home denied: {reason}")
    if math.isinf(altitude):
        return Outcome(DENIED, f"Home denied: altitude {altitude:g} is not a number")
    if math.isnan(altitude):
        up = world.home[2]
    else:
        up = world.up(altitude, above_sea=True)
        if is_relative:  # MAVSDK names a relative frame for altitudes above the sea: what is nearer the ground is meant
            up = min(up, world.up(altitude, above_sea=False), key=abs)
    return move_home(autopilot, world.local(lat, lon, up))


def move_home(autopilot: Autopilot, p: Point) -> Outcome:
    """Move home to a point, world NWU [m], or say why it may not be there."""
    moved = autopilot.world._replace(home=p)
    reason = _no_home(p, moved)
    if reason is None and autopilot.flying:
        reason = _stranded(autopilot, moved)
    if reason is not None:
        return Outcome(DENIED, f"Home denied: {reason}")
    autopilot.move(moved.frame, p)
    return Outcome(ACCEPTED)


def _no_home(p: Point, world: World) -> str | None:
    if p[2] < -BELOW_GROUND:
        return f"it would be {-p[2]:.1f} m under the ground"
    fence = world.fence._replace(home=p)
    outside = world.arena.refuse((p[0], p[1], max(p[2], 0.0)))
    breach = None if outside else fence.breach([p])
    return f"it would be {breach.text}" if breach is not None else outside


def _stranded(autopilot: Autopilot, moved: World) -> str | None:
    """Why a flying vehicle could not go on with home there: it would leave its fence, or could not fly its mission."""
    moved = moved._replace(fence=moved.fence._replace(home=moved.home))
    now, then = (world.fence.breach([autopilot.view.p]) for world in (autopilot.world, moved))
    if then is not None and now is None:
        return f"the vehicle would be {then.text}"
    if autopilot.mode is Mode.MISSION and autopilot.mission is not None:
        outside = out_of_bounds(autopilot.mission.items, moved)
        return None if outside is None else f"the mission under way could not be flown: {outside}"
    return None


def set_origin(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    """MAV_CMD_DO_SET_GLOBAL_ORIGIN: refused while armed."""
    if request.frame is not None and request.frame not in GLOBAL_FRAMES:
        return Outcome(UNSUPPORTED_FRAME, f"Origin denied: frame {request.frame} is not supported")
    return move_origin(autopilot, Geodetic(*request.params[4:7]))


def move_origin(autopilot: Autopilot, origin: Geodetic) -> Outcome:
    """Put the local frame's origin at a point, or say why it may not be there; home stays where it is in that frame."""
    if autopilot.armed:
        return Outcome(REJECTED, "Origin refused: disarm first, a flight keeps its local frame")
    if reason := _no_origin(origin):
        return Outcome(DENIED, f"Origin denied: {reason}")
    autopilot.move(LocalFrame(origin), autopilot.world.home)
    return Outcome(ACCEPTED)


def _no_origin(origin: Geodetic) -> str | None:
    if reason := _not_on_the_globe(origin.lat_deg, origin.lon_deg):
        return reason
    if abs(origin.lat_deg) > NEAREST_POLE:
        return f"latitude {origin.lat_deg:g} is too near a pole"
    if not abs(origin.alt) <= HIGHEST:
        return f"altitude {origin.alt:g} m is out of range (±{HIGHEST:g} m)"
    return None


def take_message(autopilot: Autopilot, message: Message) -> Outcome:
    """SET_HOME_POSITION or SET_GPS_GLOBAL_ORIGIN: what they ask for, as the commands that replaced them do."""
    lat, lon, alt = units.from_e7(message.latitude), units.from_e7(message.longitude), message.altitude
    if message.get_type() == "SET_GPS_GLOBAL_ORIGIN":
        return move_origin(autopilot, Geodetic(lat, lon, units.from_millimetres(alt)))
    return _set_home_at(autopilot, lat, lon, units.from_millimetres(alt), is_relative=False)


def _not_on_the_globe(lat: float, lon: float) -> str | None:
    if not (math.isfinite(lat) and math.isfinite(lon)):
        return f"no place: latitude {lat:g}, longitude {lon:g}"
    if abs(lat) > 90.0 or abs(lon) > 180.0:
        return f"latitude {lat:g}, longitude {lon:g} is not on the globe"
    return None


class HomeKeeper:
    """Home and origin between memory and autopilot: those that were kept are used from the start, if they fit.

    ``said`` has what the pilot is to know about what was kept.

    Raises:
        SitlError: The kept file cannot be read.
    """

    def __init__(self, autopilot: Autopilot, memory: Memory) -> None:
        self._autopilot, self._memory = autopilot, memory
        self._start = autopilot.world.frame.origin
        self._kept: Anchors | None = None
        self.said: list[Notice] = []
        kept = memory.anchors()
        if kept is not None:
            self._restore(kept)

    def _restore(self, kept: Anchors) -> None:
        world = self._autopilot.world
        away = math.hypot(*world.frame.to_ned(kept.start))
        if away > SAME_SITE:
            self._warn(f"Kept home not used: it belongs to a start {away / 1e3:.1f} km from here")
            return
        if reason := _no_origin(kept.origin):
            self._warn(f"Kept origin not used: {reason}")
            return
        frame = world.frame if kept.origin == kept.start else LocalFrame(kept.origin)
        home = flip(frame.to_ned(kept.home))
        if reason := _no_home(home, world._replace(frame=frame)):
            self._warn(f"Kept home not used: {reason}")
            return
        self._autopilot.move(frame, home)
        self._kept = kept
        if frame is not world.frame:
            self._tell("Kept origin is {:.7f}, {:.7f}, {:.1f} m".format(*astuple(kept.origin)))
        self._tell(f"Kept home is {self.where}")

    def _tell(self, text: str) -> None:
        self.said.append(Notice(mavlink.MAV_SEVERITY_INFO, text))

    def _warn(self, text: str) -> None:
        self.said.append(Notice(mavlink.MAV_SEVERITY_WARNING, text))

    @property
    def where(self) -> str:
        """Where home is from the origin, in words."""
        north, west, up = self._autopilot.world.home
        north, east, up = (round(length, 1) + 0.0 for length in (north, -west, up))
        return f"{north} m north, {east} m east, {up} m up"

    def keep(self) -> None:
        """Keep where home and origin are now.

        Raises:
            MemoryFaultError: They cannot be written.
        """
        world = self._autopilot.world
        anchors = Anchors(self._start, world.frame.origin, world.frame.to_geodetic(flip(world.home)))
        if anchors != self._kept:
            self._memory.keep_anchors(anchors)
            self._kept = anchors


def recheck(autopilot: Autopilot, bounds: Bounds) -> list[str]:
    """Put in force anew what is held relative to home or origin; what can no longer be flown, in words."""
    reasons = bounds.reload()
    if autopilot.mission is not None and (reason := out_of_bounds(autopilot.mission.items, autopilot.world)):
        reasons.append(f"Mission can no longer be flown: {reason}")
    return reasons
