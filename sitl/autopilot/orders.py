"""Orders of missions and peers to camera, mount, region of interest and fence; home and the origin, and their moves."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from protocol.dialect import mavlink
from protocol.frames import Geodetic, LocalFrame
from protocol.names import Mode
from sitl.autopilot.answers import ACCEPTED, DENIED, REJECTED, Answer
from sitl.autopilot.camera import Mount, YawFrom
from sitl.autopilot.flight_state import FlightState
from sitl.autopilot.mission.items import Order
from sitl.autopilot.world import World
from sitl.control.reference import Point
from sitl.defaults import MAX_ORIGIN_ALTITUDE, MAX_ORIGIN_LATITUDE
from sitl.guidance.view import VehicleView

# Carries out what missions and peers ask of camera, mount, region of interest, home and fence.
#
# https://mavlink.io/en/messages/common.html#mav_commands, https://mavlink.io/en/services/camera.html

# Home and the origin of the local frame: how they are moved, and which moves are refused.
#
# Home is where a return lands (unless a rally point is nearer) and what relative altitudes are measured from. It may be
# moved at any time, in flight as well. The origin is the position of the local frame on the globe. It may be moved on
# the ground only; home then moves along, as the same position in that frame.


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

    def refuse_mission(self, world: World | None = None) -> str | None:
        """The reason why the mission cannot be flown, in this world or another; None if it can, or there is none."""

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
    if autopilot.mode is Mode.MISSION:
        outside = autopilot.refuse_mission(moved)
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


HERE = 1.0  # param1 of DO_SET_HOME
SAME_ANGLE = math.nan  # of DO_GIMBAL_MANAGER_PITCHYAW
NOT_HELD = mavlink.GIMBAL_MANAGER_FLAGS_RETRACT | mavlink.GIMBAL_MANAGER_FLAGS_NEUTRAL
TO_NORTH = mavlink.GIMBAL_MANAGER_FLAGS_YAW_LOCK | mavlink.GIMBAL_MANAGER_FLAGS_YAW_IN_EARTH_FRAME


class Host(Housed, Protocol):
    """The autopilot, as far as orders reach."""

    def enable_fence(self, *, enabled: bool) -> None:
        """Put the fence in force, or out of it."""


class Orders:
    """Carries orders out, or says why not.

    Args:
        flight: Its camera and its region of interest.
        host: Its home and its fence.
    """

    def __init__(self, flight: FlightState, host: Host) -> None:
        self._flight, self._host = flight, host
        self.home_moved = False  # by a mission; whoever stores home sets it back
        self._handlers: dict[int, Callable[[Order], str]] = {
            mavlink.MAV_CMD_DO_DIGICAM_CONTROL: self._take_image,
            mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST: self._trigger_by_distance,
            mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL: self._trigger_by_time,
            mavlink.MAV_CMD_SET_CAMERA_MODE: self._set_mode,
            mavlink.MAV_CMD_IMAGE_START_CAPTURE: self._start_capture,
            mavlink.MAV_CMD_IMAGE_STOP_CAPTURE: self._stop_capture,
            mavlink.MAV_CMD_VIDEO_START_CAPTURE: self._start_video,
            mavlink.MAV_CMD_VIDEO_STOP_CAPTURE: self._stop_video,
            mavlink.MAV_CMD_DO_SET_ROI_LOCATION: self._look_at,
            mavlink.MAV_CMD_DO_SET_ROI: self._set_roi,
            mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: self._look_along,
            mavlink.MAV_CMD_DO_SET_ROI_NONE: self._look_nowhere,
            mavlink.MAV_CMD_DO_MOUNT_CONFIGURE: lambda _: "",  # one mount, which is always ready
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: lambda _: "",
            mavlink.MAV_CMD_DO_MOUNT_CONTROL: self._control_mount,
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: self._point_gimbal,
            mavlink.MAV_CMD_DO_SET_HOME: self._move_home,
            mavlink.MAV_CMD_DO_FENCE_ENABLE: self._enable_fence,
        }

    def carry_out(self, order: Order) -> Answer:
        """Carry an order out; the text of a refusal says why not."""
        reason = self._handlers[order.command](order)
        if not reason:
            return Answer(ACCEPTED)
        name = str(mavlink.enums["MAV_CMD"][order.command].name).removeprefix("MAV_CMD_")
        text = f"{name} denied: {reason}"
        if order.is_of_mission:
            self._flight.say(mavlink.MAV_SEVERITY_WARNING, f"Item {order.seq}: {text}")
        return Answer(DENIED, text)

    # Camera

    def _take_image(self, _order: Order) -> str:
        self._flight.camera.take_image()
        return ""

    def _trigger_by_distance(self, order: Order) -> str:
        at_once = order.param(3) == 1.0
        self._flight.camera.trigger_by_distance(order.param(1), at_once=at_once, by_mission=order.is_of_mission)
        return ""

    def _trigger_by_time(self, order: Order) -> str:
        seconds = order.param(1) / 1e3
        if seconds > 0.0:
            self._flight.camera.capture(seconds, 0, by_mission=order.is_of_mission)
        else:
            self._flight.camera.stop_capture()
        return ""

    def _start_capture(self, order: Order) -> str:
        camera, count = self._flight.camera, int(order.param(3))
        if count == 1:
            camera.take_image()
        else:
            camera.capture(order.param(2), count, by_mission=order.is_of_mission)
        return ""

    def _stop_capture(self, _order: Order) -> str:
        self._flight.camera.stop_capture()
        return ""

    def _start_video(self, _order: Order) -> str:
        self._flight.camera.record(self._flight.view.time)
        return ""

    def _stop_video(self, _order: Order) -> str:
        self._flight.camera.stop_recording()
        return ""

    def _set_mode(self, order: Order) -> str:
        self._flight.camera.mode = int(order.param(2))
        return ""

    # Mount and region of interest

    def _look_at(self, order: Order) -> str:
        world = self._flight.world
        if order.point is None:
            return "no position"
        north, west, up = order.point
        self._flight.roi = (north, west, world.home[2] if math.isnan(up) else up)
        return ""

    def _set_roi(self, order: Order) -> str:
        """The older form: a place looks there whatever the mode, as of an ArduPilot."""
        if order.point is not None:
            return self._look_at(order)
        if order.param(1) == mavlink.MAV_ROI_WPNEXT:
            return self._look_along(order)
        return self._look_nowhere(order) if order.param(1) == mavlink.MAV_ROI_NONE else "no position"

    def _look_along(self, order: Order) -> str:
        """Along the way to the next waypoint, with an offset."""
        pitch, yaw = (math.radians(order.param(number)) for number in (5, 7))
        self._flight.roi, self._flight.camera.mount = None, Mount(pitch, yaw, YawFrom.COURSE)
        return ""

    def _look_nowhere(self, _order: Order) -> str:
        self._flight.roi = self._flight.camera.mount = None
        return ""

    def _control_mount(self, order: Order) -> str:
        pitch, yaw, mode = math.radians(order.param(1)), math.radians(order.param(3)), order.param(7)
        is_held = mode == mavlink.MAV_MOUNT_MODE_MAVLINK_TARGETING
        self._flight.roi, self._flight.camera.mount = None, Mount(pitch, yaw) if is_held else None
        return ""

    def _point_gimbal(self, order: Order) -> str:
        flight, flags = self._flight, int(order.param(5))
        if flags & NOT_HELD:
            return self._look_nowhere(order)
        old = flight.camera.mount or Mount(0.0, 0.0)
        pitch, yaw = (order.param(number, SAME_ANGLE) for number in (1, 2))
        flight.roi = None
        flight.camera.mount = Mount(
            old.pitch if math.isnan(pitch) else math.radians(pitch),
            old.yaw if math.isnan(yaw) else math.radians(yaw),
            YawFrom.NORTH if flags & TO_NORTH else YawFrom.HEADING,
        )
        return ""

    # Home and fence

    def _move_home(self, order: Order) -> str:
        flight = self._flight
        point = flight.view.p if order.param(1) == HERE else order.point
        if point is None:
            return "no position"
        up = flight.world.home[2] if math.isnan(point[2]) else point[2]
        answer = move_home(self._host, (point[0], point[1], up))
        self.home_moved |= answer.accepted
        return "" if answer.accepted else answer.text.removeprefix("Home denied: ")

    def _enable_fence(self, order: Order) -> str:
        enabled = order.param(1) == 1.0
        if enabled and not self._flight.settings.fence_action:
            return "GF_ACTION is 0 (off)"
        self._host.enable_fence(enabled=enabled)
        self._flight.say(mavlink.MAV_SEVERITY_NOTICE, f"Fence {'in force' if enabled else 'off until disarmed'}")
        return ""
