"""References of streamed set-points: those that move with a velocity, and attitudes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from protocol.dialect.vocabulary import Law
from protocol.frames import Quaternion, multiply, rotate
from sitl.control.hover_attitude import full_force
from sitl.control.reference import AttitudeReference, Point, Reference, hover_at, steer
from sitl.guidance.view import MIN_HOLD_HEIGHT, VehicleView
from sitl.model import quaternions
from sitl.model.airframe import Airframe
from sitl.model.vectors import Vector

# The hover reference that moves with a velocity: that of a streamed set-point or of a pilot's sticks.

MAX_LEAD = 5.0  # of the reference over the vehicle; at 3 m/s the hover law trails by 4 m [m]
HEADING_LAG = 0.45  # by which the linear hover law trails a turning heading (collage: 0.33, nominal: 0.56) [s]
MAX_HEADING_LEAD = math.radians(30.0)  # of a turning heading over that of the vehicle


class HeadingSetpoint(NamedTuple):
    """The heading that a set-point asks for, or how fast it turns; with neither, the last heading stays."""

    heading: float | None = None  # [rad]
    turn_rate: float = 0.0  # [rad/s]


KEEP_HEADING = HeadingSetpoint()


@dataclass(slots=True)
class MovingReference:
    """A hover reference that moves with a velocity, never far from the vehicle."""

    _moved_at: float = 0.0  # time of the last move [s]
    _turned_to: float | None = None  # heading that a turn has come to [rad]; None: it does not turn

    def restart(self, time: float) -> None:
        """The next move begins now [s]."""
        self._moved_at = time

    def elapsed(self, time: float) -> float:
        """Time since the last move [s]."""
        return time - self._moved_at

    def move(
        self, v: Point, heading: HeadingSetpoint, last: Reference, view: VehicleView, max_step: float
    ) -> Reference:
        """The next reference.

        Args:
            v: Velocity, world NWU [m/s].
            heading: Of the vehicle.
            last: The reference in force.
            view: The vehicle as it is now.
            max_step: The move covers no more time than this [s].
        """
        here, dt = view.p, self._step(view.time, max_step)
        p = [last.position[i] + dt * v[i] for i in range(3)]
        away = math.dist(p, here)
        if away > MAX_LEAD:
            p = [here[i] + (p[i] - here[i]) * MAX_LEAD / away for i in range(3)]
        p[2] = max(p[2], MIN_HOLD_HEIGHT)
        return hover_at((p[0], p[1], p[2]), self._turn(heading, last.heading, view.heading, dt), last.speed)

    def _turn(self, wanted: HeadingSetpoint, last: float, now: float, dt: float) -> float:
        """The next heading [rad]: while it turns, it leads by the lag of the laws; a turn that ends stays there."""
        before = last if self._turned_to is None else self._turned_to
        if wanted.heading is not None or wanted.turn_rate == 0.0:
            stays = last if self._turned_to is None else now
            self._turned_to = None
            return stays if wanted.heading is None else wanted.heading
        ahead = math.remainder(before + wanted.turn_rate * dt - now, math.tau)
        self._turned_to = now + min(max(ahead, -MAX_HEADING_LEAD), MAX_HEADING_LEAD)
        return self._turned_to + HEADING_LAG * wanted.turn_rate

    def _step(self, time: float, max_step: float) -> float:
        since, self._moved_at = self._moved_at, time
        return min(max(time - since, 0.0), max_step)


def from_heading_axes(v: Point, heading: float) -> Point:
    """A vector forward, to the left and up at a heading [rad], in world NWU."""
    c, s = math.cos(heading), math.sin(heading)
    return (c * v[0] - s * v[1], s * v[0] + c * v[1], v[2])


# Attitude set-points: which are flown, what ends them, and the attitude that gives an acceleration.
#
# An attitude holds neither place nor speed; whoever sends it has to. The limits keep a way back to the hover open: from
# within them the zero-moment law recovered in flight without losing height (docs/laws.md).


MAX_TILT = math.radians(45.0)  # of the nose from the vertical
MIN_THRUST = 0.3  # with less the elevons have too little slipstream [-]
MAX_RATE = 3.0  # of the attitude; the reference turns no faster [rad/s]
NORM_TOLERANCE = 0.01  # a quaternion's norm differs from one by no more
MAX_SPEED = 6.0  # over the ground [m/s]
MAX_CLIMB_RATE = 4.0  # stopping a faster climb takes less thrust than the elevons need [m/s]
MAX_SINK_RATE = 3.0  # tail first the elevons lose their effect, and reverse [m/s]
ARREST_TIME = 0.8  # arresting a sink takes the height of this many seconds of it [s]
MIN_ARREST_HEIGHT = 1.0  # an arrested sink ends above this height [m]
LIFT_HEIGHT = 2.0  # from the ground up to here the position laws climb, then attitudes are flown [m]
NOSE, BELLY, UP = (1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)


@dataclass(slots=True)
class FlyAttitude:
    """Fly one streamed attitude, turning on at its own rates until the next one arrives."""

    attitude: AttitudeReference
    received: float  # [s]
    speed: float  # speed limit of the hover laws, when they take over [m/s]
    landing: bool = False

    def update(self, view: VehicleView) -> Reference:
        """The attitude as it is by now; the position is that of the vehicle."""
        now = _turned(self.attitude, view.time - self.received)
        if _tilt(now.attitude) > MAX_TILT:  # its rates lead out of the limits
            now = self.attitude._replace(rates=Vector(0.0, 0.0, 0.0))
        return steer(hover_at(view.p, belly_heading(now.attitude), self.speed), now)

    def done(self, view: VehicleView) -> bool:  # noqa: ARG002 - set-points have no end of their own
        """Never."""
        return False


def refuse_attitude(attitude: AttitudeReference, view: VehicleView) -> str | None:
    """Reason why an attitude cannot be flown in hover, or None; on the ground it waits for a thrust that lifts off."""
    if not all(map(math.isfinite, (*attitude.attitude, *attitude.rates, attitude.thrust))):
        return "attitude set-point is not a number"
    norm = math.hypot(*attitude.attitude)
    if abs(norm - 1.0) > NORM_TOLERANCE:
        return f"attitude quaternion has norm {norm:.2f}, not 1"
    if not MIN_THRUST <= attitude.thrust <= 1.0:
        return f"thrust {attitude.thrust:.2f} is not within {MIN_THRUST:g} and 1"
    if math.hypot(*attitude.rates) > MAX_RATE:
        return f"body rates of {math.hypot(*attitude.rates):.1f} rad/s exceed the limit of {MAX_RATE:g} rad/s"
    if view.forward:
        return "attitudes are flown in hover only: make a transition to hover first"
    tilt, limit = math.degrees(_tilt(attitude.attitude)), math.degrees(MAX_TILT)
    if tilt > limit + 0.01:
        return f"nose {tilt:.0f} deg from the vertical exceeds the limit of {limit:.0f} deg"
    return None


def refuse_to_go_on(view: VehicleView, last: Law) -> str | None:
    """The reason why attitude set-points can be flown no longer; None if they can.

    Args:
        view: The vehicle as it is now, while attitudes are requested.
        last: The law in force at the tick before.
    """
    if last is Law.HOVER_ATTITUDE and view.law is not Law.HOVER_ATTITUDE:
        return "attitude lost"
    if not -MAX_SINK_RATE <= view.v[2] <= MAX_CLIMB_RATE:
        return f"{'climbing' if view.v[2] > 0.0 else 'sinking'} at {abs(view.v[2]):.1f} m/s"
    if math.hypot(*view.v) > MAX_SPEED:
        return f"{math.hypot(*view.v):.1f} m/s is too fast for attitude set-points"
    if view.p[2] + ARREST_TIME * min(view.v[2], 0.0) < MIN_ARREST_HEIGHT:
        return f"{view.p[2]:.1f} m is too low for attitude set-points"
    return None


def attitude_for(acceleration: Point, heading: float, turn_rate: float, airframe: Airframe) -> AttitudeReference:
    """The attitude and thrust that give an acceleration in still air: force = m (a + g up).

    Args:
        acceleration: World NWU [m/s2].
        heading: Wanted heading of the belly [rad].
        turn_rate: Rate of that heading [rad/s].
        airframe: The design model of the laws.
    """
    x, y, z = acceleration[0], acceleration[1], acceleration[2] + airframe.g
    lift = math.hypot(x, y, z)
    upright = _upright(heading)
    q = upright if lift == 0.0 else multiply(_between(UP, (x / lift, y / lift, z / lift)), upright)
    rates = rotate((q[0], -q[1], -q[2], -q[3]), (0.0, 0.0, turn_rate))
    return AttitudeReference(quaternions.Quaternion(*q), Vector(*rates), airframe.m * lift / full_force(airframe))


def lifts(attitude: AttitudeReference, airframe: Airframe) -> bool:
    """Whether a set-point's thrust exceeds the weight."""
    return attitude.thrust * full_force(airframe) > airframe.m * airframe.g


def belly_heading(q: Quaternion) -> float:
    """Azimuth of the belly, world NWU [rad]."""
    north, west, _ = rotate(q, BELLY)
    return math.atan2(west, north)


def _upright(heading: float) -> Quaternion:
    """Nose up, the belly to a heading: a turn about the vertical after one of -90 deg about y."""
    c, s = math.sqrt(0.5) * math.cos(0.5 * heading), math.sqrt(0.5) * math.sin(0.5 * heading)
    return (c, s, -c, s)


def _between(a: Point, b: Point) -> Quaternion:
    """The shortest rotation from one unit vector to another; half a turn about x between opposite ones."""
    w = 1.0 + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    norm = math.hypot(w, x, y, z)
    return (w / norm, x / norm, y / norm, z / norm) if norm > 1e-9 else (0.0, 1.0, 0.0, 0.0)


def _tilt(q: Quaternion) -> float:
    return math.acos(min(max(rotate(q, NOSE)[2] / math.hypot(*q) ** 2, -1.0), 1.0))


def _turned(attitude: AttitudeReference, seconds: float) -> AttitudeReference:
    """The attitude after turning at its rates for a time, its quaternion of unit norm."""
    rate = math.hypot(*attitude.rates)
    half = 0.5 * rate * seconds
    scale = 0.5 * seconds if half == 0.0 else math.sin(half) / rate
    p, q, r = attitude.rates
    w, x, y, z = multiply(attitude.attitude, (math.cos(half), scale * p, scale * q, scale * r))
    norm = math.hypot(w, x, y, z)
    return attitude._replace(attitude=quaternions.Quaternion(w / norm, x / norm, y / norm, z / norm))
