"""The cameras: from the true motion of the vehicle to frames, late and wrong as the instrument's specification says.

Position noise, attitude noise, misalignment, steps, drop-outs, delay and jitter are those of the motion capture that
the vehicle simulates itself (:mod:`sitl.sensors.aiding`), by the same functions and the same file. Here the errors are
of the markers: what of the attitude's noise the markers do not bring is added to the whole body.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from protocol.natnet import CLOCK, BodyPose, CaptureFrame
from sitl.model.airframe import Array
from sitl.model.arithmetic import rounded
from sitl.motion_capture.disturbances import Disturbances, Trouble
from sitl.motion_capture.hall_axes import HallAxes
from sitl.motion_capture.rigid_body import RigidBody, pose_by_markers
from sitl.sensors.aiding import arrival, reads
from sitl.sensors.draws import in_fine_steps
from sitl.sensors.hidden_errors import drawn_errors
from sitl.sensors.instruments import HEALTHY
from sitl.sensors.specification import SensorSet

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
        first_draws = in_fine_steps(np.random.default_rng((seed, 2)).standard_normal(15))
        misaligned = Rotation.from_rotvec(np.array(drawn_errors(sensors, first_draws).misalignment))
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
        is_dropped = not reads(self._number, timing, HEALTHY, float(self._draws.random()), 1.0 / timing.rate)
        body, seen = self._seen(position, attitude, draws, troubles)
        exposed = round(time * CLOCK)
        sent = arrival(exposed, timing, HEALTHY, float(draws[0, 0]), CLOCK_TICK)
        if self._on_their_way:  # they keep their order
            sent = max(sent, self._on_their_way[-1].transmitted)
        if is_dropped or Trouble.DROPPED in troubles:
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
