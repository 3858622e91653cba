"""A simulated camera on an ideal mount: triggered by distance, by time or once, so that a survey can be rehearsed.

At rest it is fixed to the body and looks out of the belly: ahead in the hover, straight down in forward flight. A mount
that is told angles, or a place to look at, holds them at once and level. Images have a place, an attitude and a number,
but no picture.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.frames import Quaternion, flip_quaternion, hover_attitude, quaternion_from_euler
from sitl.control.reference import Point
from sitl.guidance.view import VehicleView

MIN_INTERVAL = 0.1  # between two images; one that is asked for earlier is taken then [s]
IMAGE_SIZE = 8.0  # [MiB]
STORAGE_SIZE = 32768.0  # [MiB]
MAX_KEPT = 1000  # images whose place can be asked for again
COURSE_SPEED = 1.0  # slower than this over the ground, the course is the heading [m/s]


class YawFrom(Enum):
    """From where a mount's yaw counts."""

    HEADING = "heading"
    COURSE = "course"
    NORTH = "north"


class Mount(NamedTuple):
    """Angles of the optical axis [rad]."""

    pitch: float  # above the horizon
    yaw: float  # clockwise
    yaw_from: YawFrom = YawFrom.HEADING


class Capture(NamedTuple):
    """An image."""

    number: int  # from 0
    time: float  # since boot [s]
    p: Point  # world NWU [m]
    q: Quaternion  # camera (x along the optical axis, z down in the image) -> NED
    is_stored: bool  # else the storage was full


@dataclass(slots=True)
class Camera:
    """State of the camera: pending requests and images taken. After ``update``: read ``captures`` and clear them."""

    mode: int = mavlink.CAMERA_MODE_IMAGE
    distance: float = 0.0  # between images [m]; 0: not triggered by distance
    interval: float = 0.0  # between images [s]; 0: not triggered by time
    remaining: int = 0  # images by time that are still to be taken; -1: without end
    recording_since: float | None = None  # [s]
    mount: Mount | None = None  # None: fixed to the body
    count: int = 0  # images stored
    paused: bool = False  # triggers of a mission that was left wait for it
    captures: list[Capture] = field(default_factory=list)
    kept: dict[int, Capture] = field(default_factory=dict)  # the latest, by number
    _by_mission: bool = False  # who set the triggers
    _at_once: bool = False  # an image is to be taken at the next tick
    _due: float = math.inf  # time of the next image by time [s]
    _last: tuple[float, float] | None = None  # where the distance counts from, level NWU [m]
    _last_time: float = -math.inf  # of the latest image [s]
    _before: tuple[float, Point] | None = None  # time and place of the tick before

    def trigger_by_distance(self, distance: float, *, at_once: bool, by_mission: bool = False) -> None:
        """Take an image whenever the vehicle is so far from where it took the last [m]; 0 ends that."""
        self.distance, self._last = distance, None
        self._at_once |= at_once and distance > 0.0
        self._by_mission, self.paused = by_mission, False

    def capture(self, interval: float, count: int, *, by_mission: bool = False) -> None:
        """Take images from now on.

        Args:
            interval: Between them [s].
            count: How many; 0: without end.
            by_mission: Whether a mission asks for it, and leaving that suspends it.
        """
        self.interval, self.remaining, self._due = max(interval, MIN_INTERVAL), count or -1, -math.inf
        self._by_mission, self.paused = by_mission, False

    def take_image(self) -> None:
        """Take one image; triggers go on."""
        self._at_once = True

    def stop_capture(self) -> None:
        """End the images by time."""
        self.interval, self.remaining, self._due = 0.0, 0, math.inf

    def record(self, time: float) -> None:
        """Begin a video, unless there is one."""
        self.recording_since = time if self.recording_since is None else self.recording_since

    def stop_recording(self) -> None:
        """End the video."""
        self.recording_since = None

    def leave_mission(self) -> None:
        """A mission is left: what it triggers waits."""
        self.paused = self._by_mission

    def resume_mission(self) -> None:
        """It is flown again."""
        self.paused, self._last = False, None

    def begin_mission(self) -> None:
        """It begins anew: what it triggered before is over."""
        if self._by_mission:
            self.stop_capture()
            self.distance, self._by_mission, self.paused = 0.0, False, False

    @property
    def free(self) -> float:
        """Free storage [MiB]."""
        return STORAGE_SIZE - IMAGE_SIZE * self.count

    def update(self, view: VehicleView, target: Point | None = None) -> None:
        """Take the images that are due since the tick before.

        Args:
            view: The vehicle as it is now.
            target: Where to look, world NWU [m]; None: as the mount is told.
        """
        before, self._before = self._before or (view.time, view.p), (view.time, view.p)
        if self._at_once and self._is_ready(view.time):
            self._at_once = False
            self._take(view.time, view.p, view, target)
        if self.paused:
            return
        if self.remaining:
            self._take_by_time(before, view, target)
        if self.distance > 0.0:
            self._take_by_distance(before, view, target)

    def _is_ready(self, time: float) -> bool:
        return time - self._last_time >= MIN_INTERVAL - 1e-9

    def _take_by_time(self, before: tuple[float, Point], view: VehicleView, target: Point | None) -> None:
        if self._due == -math.inf:
            self._due = view.time
        if view.time < self._due:
            return
        share = _share(self._due - before[0], view.time - before[0])
        self._take(self._due, _between(before[1], view.p, share), view, target)
        self._due += self.interval
        self.remaining -= self.remaining > 0
        if self.remaining == 0:
            self.stop_capture()

    def _take_by_distance(self, before: tuple[float, Point], view: VehicleView, target: Point | None) -> None:
        if self._last is None:
            self._last = view.p[:2]
            return
        share = _crossing(before[1], view.p, self._last, self.distance)
        time = before[0] + share * (view.time - before[0])
        if share > 1.0 or not self._is_ready(time):
            return
        p = _between(before[1], view.p, share)
        self._take(time, p, view, target)
        self._last = p[:2]

    def _take(self, time: float, p: Point, view: VehicleView, target: Point | None) -> None:
        is_stored = self.free >= IMAGE_SIZE
        capture = Capture(self.count, time, p, self.attitude(p, view, target), is_stored)
        self._last_time = time
        self.captures.append(capture)
        if is_stored:
            self.count += 1
            self.kept[capture.number] = capture
            if len(self.kept) > MAX_KEPT:
                del self.kept[next(iter(self.kept))]

    def attitude(self, p: Point, view: VehicleView, target: Point | None = None) -> Quaternion:
        """Attitude of the camera, camera -> NED; arguments as of ``update``, ``p`` is the position of the vehicle."""
        if target is not None:
            north, east, up = target[0] - p[0], p[1] - target[1], target[2] - p[2]
            return quaternion_from_euler(0.0, math.atan2(up, math.hypot(north, east)), math.atan2(east, north))
        if self.mount is None:
            return hover_attitude(flip_quaternion(view.attitude))
        zero = {YawFrom.HEADING: -view.heading, YawFrom.COURSE: _course(view), YawFrom.NORTH: 0.0}
        return quaternion_from_euler(0.0, self.mount.pitch, zero[self.mount.yaw_from] + self.mount.yaw)


def _course(view: VehicleView) -> float:
    """Course over the ground, clockwise from north [rad]."""
    is_moving = math.hypot(view.v[0], view.v[1]) > COURSE_SPEED
    return math.atan2(-view.v[1], view.v[0]) if is_moving else -view.heading


def _share(part: float, whole: float) -> float:
    return min(max(part / whole, 0.0), 1.0) if whole > 0.0 else 1.0


def _between(a: Point, b: Point, share: float) -> Point:
    return (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2]))


def _crossing(a: Point, b: Point, centre: tuple[float, float], radius: float) -> float:
    """The share of the way from a to b at which a level circle is left; above 1 if it is not."""
    if math.dist(b[:2], centre) < radius:
        return math.inf
    x, y = a[0] - centre[0], a[1] - centre[1]
    u, v = b[0] - a[0], b[1] - a[1]
    square, along = u * u + v * v, x * u + y * v
    if square == 0.0:
        return 1.0
    inside = radius * radius - x * x - y * y
    return _share(math.sqrt(max(along * along + square * inside, 0.0)) - along, square)
