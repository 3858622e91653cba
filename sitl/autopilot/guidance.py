"""Guidance: what turns a mode or a mission item into set-points for the hover laws.

Each guidance is asked once per autopilot tick and answers with a :class:`Setpoint`; time comes in with the
:class:`View`. World frame NWU, SI units, headings in radians about world z (from north towards west).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

from sitl.hybrid.supervisor import Law

Vector = tuple[float, float, float]

SLOWEST, FASTEST = 7.0, 22.0  # airspeeds of the cruise on the wing [m/s]
SLOW_BELOW = 5.0  # landings take their time from here on [m]
FAST_DESCENT = 1.5  # above that [m/s]
SLOW = 1.0  # as good as standing [m/s]


class View(NamedTuple):
    """What the autopilot knows of the vehicle at one tick."""

    time: float  # since boot [s]
    p: Vector  # position, world NWU [m]
    v: Vector  # velocity, world NWU [m/s]
    heading: float  # where the nose goes when tipped over [rad]
    tilt: float  # angle between the nose and the vertical [rad]
    landed: bool  # the supervisor's law is LANDED
    energy_left: float  # share of the battery, 0..1
    forward: bool = False  # tipping over, on the wing, or standing up again
    wind: Vector = (0.0, 0.0, 0.0)  # as it is estimated, world NWU [m/s]
    stopping: float = 0.0  # distance the present speed takes to stop, on the wing [m]
    energy: float = math.inf  # left in the battery [J]
    law: Law = Law.LANDED  # in force


class Route(NamedTuple):
    """A path to be flown on the wing: a leg from start to end, or a circle about start."""

    kind: int  # sitl.laws.path.LEG or CIRCLE
    start: Vector  # world NWU [m]
    end: Vector  # world NWU [m]
    airspeed: float  # [m/s]
    stop: bool = True  # whether the leg ends at rest
    level: float = 0.0  # the leg's last metres are flown without a slope [m]
    low: float = 0.0  # and so far below its end [m]
    radius: float = 0.0  # of a circle [m]; positive: anticlockwise seen from above


class Attitude(NamedTuple):
    """An attitude to be flown instead of a position."""

    q: tuple[float, float, float, float]  # body FLU in world NWU, unit
    rates: Vector  # of the attitude itself, in its body frame FLU [rad/s]
    thrust: float  # share of what both motors give at their limit, 0..1


class Setpoint(NamedTuple):
    """Where the laws shall bring the vehicle."""

    p: Vector  # position, world NWU [m]
    heading: float  # [rad]
    speed: float  # horizontal speed limit of the hover laws [m/s]
    route: Route | None = None  # how to get there on the wing; None: upright
    attitude: Attitude | None = None  # flown instead; p is then where the vehicle is


class Guidance(Protocol):
    """One manoeuvre."""

    @property
    def landing(self) -> bool:
        """Whether touching the ground ends it."""

    def update(self, view: View) -> Setpoint:
        """The set-point for this tick."""

    def done(self, view: View) -> bool:
        """Whether the manoeuvre is complete; asked after ``update``."""


def distance(a: Vector, b: Vector) -> float:
    """Distance between two points [m]."""
    return math.dist(a, b)


@dataclass(slots=True)
class Hold:
    """Stay at a set-point for ever."""

    setpoint: Setpoint
    landing: bool = False

    def update(self, view: View) -> Setpoint:  # noqa: ARG002 - the set-point never moves
        """The held set-point."""
        return self.setpoint

    def done(self, view: View) -> bool:  # noqa: ARG002 - holding has no end of its own
        """Never."""
        return False


@dataclass(slots=True)
class Stop:
    """Come to rest upright at a set-point, however near it."""

    setpoint: Setpoint
    landing: bool = False

    def update(self, view: View) -> Setpoint:  # noqa: ARG002 - the set-point never moves
        """The set-point."""
        return self.setpoint

    def done(self, view: View) -> bool:
        """Upright and slow."""
        return not view.forward and math.hypot(*view.v) < SLOW


@dataclass(slots=True)
class FlyTo:
    """Go to a point and stay there for ``hold`` seconds within ``acceptance`` metres.

    The laws get the point itself, not a ramp towards it: how to cover the distance is what the hybrid
    controller is for.
    """

    setpoint: Setpoint
    acceptance: float
    hold: float = 0.0
    landing: bool = False
    arrived: float | None = None

    def update(self, view: View) -> Setpoint:
        """The point; notes when the vehicle arrived."""
        if self.arrived is None and distance(view.p, self.setpoint.p) <= self.acceptance:
            self.arrived = view.time
        return self.setpoint

    def done(self, view: View) -> bool:
        """Arrived, and held long enough since."""
        return self.arrived is not None and view.time - self.arrived >= self.hold


@dataclass(slots=True)
class Ramp:
    """Move the set-point straight up or down at a steady rate: take-off and landing.

    A step in altitude would make the linear law push at its limits close to the ground.
    """

    setpoint: Setpoint  # where the ramp ends
    rate: float  # vertical speed, positive [m/s]
    slow_below: float = math.inf  # above this altitude a descent is faster [m]
    landing: bool = False
    acceptance: float = 0.3
    began: tuple[float, float] | None = None  # time and altitude of the first tick

    def update(self, view: View) -> Setpoint:
        """The set-point on its way."""
        if self.began is None:
            self.began = (view.time, view.p[2])
        since, start = self.began
        end = self.setpoint.p[2]
        elapsed = view.time - since
        if end >= start:
            return replace_altitude(self.setpoint, min(start + self.rate * elapsed, end))
        above = max(start - self.slow_below, 0.0)
        fast = min(elapsed, above / FAST_DESCENT)
        z = start - FAST_DESCENT * fast - self.rate * (elapsed - fast)
        return replace_altitude(self.setpoint, max(z, end))

    def done(self, view: View) -> bool:
        """At the end of the ramp; a landing is ended by the ground instead."""
        return not self.landing and abs(view.p[2] - self.setpoint.p[2]) <= self.acceptance


@dataclass(slots=True)
class Sequence:
    """Several manoeuvres, one after the other: climb, go home, land."""

    steps: tuple[Guidance, ...]
    index: int = 0

    @property
    def landing(self) -> bool:
        """Whether the present step is a landing."""
        return self.steps[self.index].landing

    def update(self, view: View) -> Setpoint:
        """The present step's set-point; moves on when it is done."""
        setpoint = self.steps[self.index].update(view)
        if self.steps[self.index].done(view) and self.index + 1 < len(self.steps):
            self.index += 1
            return self.steps[self.index].update(view)
        return setpoint

    def done(self, view: View) -> bool:
        """Whether the last step is done."""
        return self.index + 1 == len(self.steps) and self.steps[self.index].done(view)


def replace_altitude(setpoint: Setpoint, z: float) -> Setpoint:
    """The set-point at another altitude."""
    return setpoint._replace(p=(setpoint.p[0], setpoint.p[1], z))


def land_at(setpoint: Setpoint, rate: float) -> Ramp:
    """Descend on the spot, through the ground: contact ends it. High up it goes faster."""
    return Ramp(replace_altitude(setpoint, -1.0), rate, slow_below=SLOW_BELOW, landing=True)


def with_speed(guidance: FlyTo | Hold, speed: float) -> FlyTo | Hold:
    """The same guidance under another speed limit."""
    return replace(guidance, setpoint=guidance.setpoint._replace(speed=speed))
