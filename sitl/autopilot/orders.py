"""Carries out what missions and peers ask of camera, mount, region of interest, home and fence.

https://mavlink.io/en/messages/common.html#mav_commands, https://mavlink.io/en/services/camera.html
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from protocol.dialect import mavlink
from sitl.autopilot.answers import ACCEPTED, DENIED, Answer
from sitl.autopilot.camera import Mount, YawFrom
from sitl.autopilot.flight_state import FlightState
from sitl.autopilot.home import Housed, move_home
from sitl.autopilot.mission.order_items import Order

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
