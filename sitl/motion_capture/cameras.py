"""The cameras of a hall: its axes, disturbances, and the frames that they make of the vehicle's true motion."""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Iterator
from enum import Enum
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from protocol.natnet import CLOCK, BodyPose, CaptureFrame
from sitl.errors import SitlError
from sitl.model.airframe import Array
from sitl.model.arithmetic import rounded
from sitl.motion_capture.rigid_body import RigidBody, pose_by_markers
from sitl.sensors.aiding import arrival, is_lost
from sitl.sensors.draws import in_fine_steps
from sitl.sensors.hidden_errors import ERROR_DRAWS, MOUNTING_DRAWS, drawn_errors
from sitl.sensors.instruments import HEALTHY, SensorSet

# The cameras: from the true motion of the vehicle to frames, late and wrong as the instrument's specification says.
#
# Position noise, attitude noise, misalignment, steps, drop-outs, delay and jitter are those of the motion capture that
# the vehicle simulates itself (:mod:`sitl.sensors.aiding`), by the same functions and the same file. Here the errors
# are of the markers: what of the attitude's noise the markers do not bring is added to the whole body.

# Motive's axes in the hall, from its calibration and its streaming; and the vehicle's world there.
#
# The hall is seen by its observers: right, far, up. Motive's ground plane is laid by a triangle whose long edge points
# to a side; that is its z axis, and y is up. Streamed with z up, the long edge is -y.


SIDES = {"right": 0.0, "far": 90.0, "left": 180.0, "near": 270.0}  # azimuth from the right, towards far [deg]
UPWARDS = np.array((0.0, 0.0, 1.0))


class HallAxes(NamedTuple):
    """Calibration of the cameras, and the vehicle's world in the hall; ENAC's by default."""

    up_axis: str = "z"  # of the stream
    long_edge: str = "near"  # side the triangle's long edge pointed to
    east: float = 0.0  # azimuth of east from the right, towards far [deg]
    front: str = "far"  # side the vehicle's front pointed to when its rigid body was made

    def to_stream(self) -> Rotation:
        """From the world NWU to the axes of the stream."""
        edge = _towards(SIDES[self.long_edge])
        if self.up_axis == "y":
            axes = np.array((np.cross(UPWARDS, edge), UPWARDS, edge))
        else:
            axes = np.array((np.cross(-edge, UPWARDS), -edge, UPWARDS))
        world = np.column_stack(
            (_towards(self.east + 90.0), _towards(self.east + 180.0), UPWARDS)
        )  # NWU axes in the hall
        return Rotation.from_matrix(axes @ world)

    def attitude_when_made(self) -> Rotation:
        """Body FLU to world NWU when the rigid body was made: upright on its tail, its front to a side.

        The front of a tail-sitter on its tail is its belly.
        """
        towards = math.radians(SIDES[self.front] - self.east - 90.0)  # azimuth from north, towards west
        belly = np.array((math.cos(towards), math.sin(towards), 0.0))
        return Rotation.from_matrix(np.column_stack((UPWARDS, np.cross(-belly, UPWARDS), -belly)))


def _towards(degrees: float) -> Array:
    """Level unit vector of the hall."""
    return np.array((math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), 0.0))


# Disturbances that a person orders: tracking lost, markers swapped, frames dropped; at given times, or from now on.


MAX_TIME = 1e6  # [s]
_WRITTEN = re.compile(r"(?P<kind>\w+)@(?P<start>[\d.]+)(?:\+(?P<duration>[\d.]+))?")


class Trouble(Enum):
    """Kind of a passing disturbance."""

    LOST = "lost"  # Motive streams, and says that it does not see the body
    SWAP = "swap"  # it takes markers for one another, which turns the body
    DROPPED = "dropped"  # its frames do not arrive


class Disturbance(NamedTuple):
    """One of them; times since the first frame [s]."""

    trouble: Trouble
    start: float
    end: float


def read_disturbance(text: str) -> Disturbance:
    """KIND@START or KIND@START+SECONDS; without a duration it lasts.

    Raises:
        SitlError: The text is none.
    """
    written = _WRITTEN.fullmatch(text)
    kinds = [kind.value for kind in Trouble]
    if not written or written["kind"] not in kinds:
        raise SitlError(f"{text!r} is not KIND@START+SECONDS, with KIND of {', '.join(kinds)}")
    start, duration = _seconds(text, written["start"]), written["duration"]
    end = math.inf if duration is None else start + _seconds(text, duration)
    return Disturbance(Trouble(written["kind"]), start, end)


def _seconds(text: str, number: str) -> float:
    try:
        value = float(number)
    except ValueError:
        raise SitlError(f"{text!r}: {number} is not a number of seconds") from None
    if value > MAX_TIME:
        raise SitlError(f"{text!r}: {number} s is above {MAX_TIME:g} s")
    return value


class Disturbances:
    """Schedule of disturbances; more can be ordered while it runs."""

    def __init__(self, planned: tuple[Disturbance, ...] = ()) -> None:
        self._planned = list(planned)

    def order(self, words: str, time: float) -> str:
        """Take a line that a person types: ``lost``, ``lost 2`` or ``ok``; gives what to answer.

        Args:
            words: The line.
            time: Now, since the first frame [s].
        """
        kind, _, duration = words.strip().partition(" ")
        if kind == "ok":
            self._planned = [each._replace(end=min(each.end, time)) for each in self._planned if each.start <= time]
            return "all disturbances ended"
        try:
            ordered = read_disturbance(f"{kind}@{time:.6f}" + (f"+{duration.strip()}" if duration else ""))
        except SitlError:
            return f"{words.strip()!r}: type lost, swap or dropped, with seconds or without, or ok"
        self._planned.append(ordered)
        return f"{kind} for {ordered.end - ordered.start:g} s" if duration else f"{kind} until ok"

    def now(self, time: float) -> frozenset[Trouble]:
        """The disturbances at a time since the first frame [s]."""
        return frozenset(each.trouble for each in self._planned if each.start <= time < each.end)


MAX_GAP = 0.1  # between two true states; a longer one is not bridged [s]
CAMERA_SHARE = 0.5  # of the delay: exposure to Motive; the rest is Motive's
CLOCK_TICK = 1.0 / CLOCK  # [s]


class TrueMotion(NamedTuple):
    """The vehicle at one instant."""

    time: float  # since its boot [s]
    position: Array  # world NWU [m]
    velocity: Array  # [m/s]
    attitude: Rotation  # body FLU to world NWU
    rates: Array  # body FLU [rad/s]


def between(a: TrueMotion, b: TrueMotion, time: float) -> tuple[Array, Rotation]:
    """Position and attitude at a time between two instants: cubic in position and turn, by velocities and rates."""
    h = b.time - a.time
    s = (time - a.time) / h
    turn = (a.attitude.inv() * b.attitude).as_rotvec()
    position = _cubic(a.position, a.velocity * h, b.position, b.velocity * h, s)
    turned = _cubic(np.zeros(3), a.rates * h, turn, b.rates * h, s)
    return position, a.attitude * Rotation.from_rotvec(turned)


def _cubic(p: Array, dp: Array, q: Array, dq: Array, s: float) -> Array:
    """Hermite's polynomial."""
    back = 1.0 - s
    kept: Array = back * back * ((1.0 + 2.0 * s) * p + s * dp) + s * s * ((1.0 + 2.0 * back) * q - back * dq)
    return kept


class Cameras:
    """Makes frames of the true motion.

    Args:
        sensors: Their motion capture is what the cameras are like.
        body: What they look for.
        axes: Of the stream and the hall.
        seed: Of the errors; that of the vehicle's own cameras misaligns the body alike.
        disturbances: What a person orders.
    """

    def __init__(
        self, sensors: SensorSet, body: RigidBody, axes: HallAxes, seed: int, disturbances: Disturbances
    ) -> None:
        self._spec, self._disturbances = sensors.motion_capture, disturbances
        first_draws = in_fine_steps(np.random.default_rng((seed, 2)).standard_normal(ERROR_DRAWS))
        hidden = drawn_errors(sensors, first_draws, np.zeros(MOUNTING_DRAWS))  # it does not matter where the rest sits
        misaligned = Rotation.from_rotvec(np.array(hidden.misalignment))
        self._to_stream = axes.to_stream()
        # The body lay on the airframe's axes but for the misalignment when the operator made it.
        self.body = body.made(self._to_stream * axes.attitude_when_made() * misaligned.inv())
        self._made = np.array(self.body.streamed_markers)
        self._swapped = list(body.swapped())
        self._marker_noise = self._spec.noise * np.sqrt(len(self._made))  # so that the mean of all has the noise told
        by_markers = body.attitude_spread(self._marker_noise)
        self._wobble = np.sqrt(np.maximum(self._spec.attitude_noise**2 - by_markers**2, 0.0))
        self._draws = np.random.default_rng((seed, 5))
        self._last: TrueMotion | None = None
        self._is_lost = False
        self._number = self._first_number = 0  # of the next frame, and where the time of disturbances begins
        self._shown = BodyPose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), 0.0, is_tracked=False)
        self._on_their_way: deque[CaptureFrame] = deque()

    @property
    def time(self) -> float:
        """Of the last exposure, since the first [s]."""
        return (self._number - self._first_number) / self._spec.timing.rate

    @property
    def next_sent(self) -> int | None:
        """Tick at which Motive sends the next frame that it has; None if it has none."""
        return self._on_their_way[0].transmitted if self._on_their_way else None

    def look(self, motion: TrueMotion) -> None:
        """Expose frames up to an instant. After a gap or a restart of the vehicle they begin anew."""
        last, self._last = self._last, motion
        if last is None or not 0.0 < motion.time - last.time <= MAX_GAP:
            number = int(motion.time * self._spec.timing.rate) + 1
            if last is None or motion.time < last.time:  # the vehicle's clock has begun anew: ours goes on
                self._on_their_way.clear()
                self._first_number += number - self._number
            self._number = number
            return
        while (time := self._number / self._spec.timing.rate) <= motion.time:
            self._expose(time, *between(last, motion, time))
            self._number += 1

    def frames(self, now: float) -> Iterator[CaptureFrame]:
        """Those that Motive has sent by a time of the vehicle [s], in order."""
        while self._on_their_way and self._on_their_way[0].transmitted <= round(now * CLOCK):
            yield self._on_their_way.popleft()

    def _expose(self, time: float, position: Array, attitude: Rotation) -> None:
        draws = in_fine_steps(self._draws.standard_normal((len(self._made) + 2, 3)))
        timing, troubles = self._spec.timing, self._disturbances.now(self.time)
        self._is_lost = is_lost(self._is_lost, self._spec, float(self._draws.random()))
        body, seen = self._seen(position, attitude, draws, troubles)
        exposed = round(time * CLOCK)
        sent = arrival(exposed, timing, HEALTHY, float(draws[0, 0]), CLOCK_TICK)
        if self._on_their_way:  # they keep their order
            sent = max(sent, self._on_their_way[-1].transmitted)
        if self._is_lost or Trouble.DROPPED in troubles:
            return
        received = exposed + round(CAMERA_SHARE * timing.delay * CLOCK)
        markers = tuple((k + 1, (float(x), float(y), float(z))) for k, (x, y, z) in enumerate(seen))
        self._on_their_way.append(CaptureFrame(self._number, exposed, received, sent, body, markers))

    def _seen(
        self, position: Array, attitude: Rotation, draws: Array, troubles: frozenset[Trouble]
    ) -> tuple[BodyPose, Array]:
        """The body's pose as Motive finds it, and its markers."""
        if Trouble.LOST in troubles:
            self._shown = self._shown._replace(is_tracked=False)
            return self._shown, np.zeros((0, 3))
        shaken = attitude * Rotation.from_rotvec(self._wobble * draws[1])
        seen = self._to_stream.apply(position + shaken.apply(self.body.markers))
        seen += self._marker_noise * draws[2:]
        labelled = seen[self._swapped] if Trouble.SWAP in troubles else seen
        pose = pose_by_markers(labelled, self._made)
        x, y, z = (self._spec.step * rounded(float(part) / self._spec.step) for part in pose.position)
        qx, qy, qz, qw = pose.attitude.as_quat().tolist()
        self._shown = BodyPose((x, y, z), (qx, qy, qz, qw), pose.marker_error, is_tracked=True)
        return self._shown, labelled
