"""Guidance: what turns a mode or a mission item into references for the laws.

Each guidance is asked once per autopilot tick and answers with a :class:`Reference`; time comes in with the
:class:`View`. World frame NWU, SI units, headings in radians about world z (from north towards west).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

from protocol.dialect.vocabulary import Law
from sitl.control.reference import Point, Reference, at

MIN_AIRSPEED, MAX_AIRSPEED = 7.0, 22.0  # airspeeds of the cruise [m/s]
SLOW_BELOW = 5.0  # landings take their time from here on [m]
FAST_DESCENT = 1.5  # above that [m/s]
SLOW = 1.0  # as good as standing [m/s]


class View(NamedTuple):
    """What the autopilot knows of the vehicle at one tick."""

    time: float  # since boot [s]
    p: Point  # position, world NWU [m]
    v: Point  # velocity, world NWU [m/s]
    heading: float  # where the nose goes when tipped over [rad]
    tilt: float  # angle between the nose and the vertical [rad]
    landed: bool  # the supervisor's law is LANDED
    energy_left: float  # share of the battery, 0..1
    forward: bool = False  # in forward flight, or in transition there or back
    wind: Point = (0.0, 0.0, 0.0)  # as it is estimated, world NWU [m/s]
    stopping: float = 0.0  # distance the present speed takes to stop in forward flight [m]
    energy: float = math.inf  # left in the battery [J]
    law: Law = Law.LANDED  # in force


class Guidance(Protocol):
    """One manoeuvre."""

    @property
    def landing(self) -> bool:
        """Whether touching the ground ends it."""

    def update(self, view: View) -> Reference:
        """The reference for this tick."""

    def done(self, view: View) -> bool:
        """Whether the manoeuvre is complete; asked after ``update``."""


def distance(a: Point, b: Point) -> float:
    """Distance between two points [m]."""
    return math.dist(a, b)


@dataclass(slots=True)
class Hold:
    """Stay at a reference for ever."""

    reference: Reference
    landing: bool = False

    def update(self, view: View) -> Reference:  # noqa: ARG002 - the reference never moves
        """The reference."""
        return self.reference

    def done(self, view: View) -> bool:  # noqa: ARG002 - holding has no end of its own
        """Never."""
        return False


@dataclass(slots=True)
class Stop:
    """Come to rest upright at a reference, however near it."""

    reference: Reference
    landing: bool = False

    def update(self, view: View) -> Reference:  # noqa: ARG002 - the reference never moves
        """The reference."""
        return self.reference

    def done(self, view: View) -> bool:
        """Upright and slow."""
        return not view.forward and math.hypot(*view.v) < SLOW


@dataclass(slots=True)
class FlyTo:
    """Go to a point and stay there for ``hold`` seconds within ``acceptance`` metres.

    The laws get the point itself, not a ramp towards it: how to cover the distance is what the hybrid
    controller is for.
    """

    reference: Reference
    acceptance: float
    hold: float = 0.0
    landing: bool = False
    arrived: float | None = None

    def update(self, view: View) -> Reference:
        """The point; notes when the vehicle arrived."""
        if self.arrived is None and distance(view.p, self.reference.position) <= self.acceptance:
            self.arrived = view.time
        return self.reference

    def done(self, view: View) -> bool:
        """Arrived, and held long enough since."""
        return self.arrived is not None and view.time - self.arrived >= self.hold


@dataclass(slots=True)
class Ramp:
    """Move the reference straight up or down at a steady rate: take-off and landing.

    A step in altitude would make the linear law push at its limits close to the ground.
    """

    reference: Reference  # where the ramp ends
    rate: float  # vertical speed, positive [m/s]
    slow_below: float = math.inf  # above this altitude a descent is faster [m]
    landing: bool = False
    acceptance: float = 0.3
    began: tuple[float, float] | None = None  # time and altitude of the first tick

    def update(self, view: View) -> Reference:
        """The reference on its way."""
        if self.began is None:
            self.began = (view.time, view.p[2])
        since, start = self.began
        end = self.reference.position[2]
        elapsed = view.time - since
        if end >= start:
            return replace_altitude(self.reference, min(start + self.rate * elapsed, end))
        above = max(start - self.slow_below, 0.0)
        fast = min(elapsed, above / FAST_DESCENT)
        z = start - FAST_DESCENT * fast - self.rate * (elapsed - fast)
        return replace_altitude(self.reference, max(z, end))

    def done(self, view: View) -> bool:
        """At the end of the ramp; a landing is ended by the ground instead."""
        return not self.landing and abs(view.p[2] - self.reference.position[2]) <= self.acceptance


@dataclass(slots=True)
class Sequence:
    """Several manoeuvres, one after the other: climb, go home, land."""

    steps: tuple[Guidance, ...]
    index: int = 0

    @property
    def landing(self) -> bool:
        """Whether the present step is a landing."""
        return self.steps[self.index].landing

    def update(self, view: View) -> Reference:
        """The present step's reference; moves on when it is done."""
        reference = self.steps[self.index].update(view)
        if self.steps[self.index].done(view) and self.index + 1 < len(self.steps):
            self.index += 1
            return self.steps[self.index].update(view)
        return reference

    def done(self, view: View) -> bool:
        """Whether the last step is done."""
        return self.index + 1 == len(self.steps) and self.steps[self.index].done(view)


def replace_altitude(reference: Reference, z: float) -> Reference:
    """The reference at another altitude."""
    return at(reference, (reference.position.x, reference.position.y, z))


def land_at(reference: Reference, rate: float) -> Ramp:
    """Descend on the spot, through the ground: contact ends it. High up it goes faster."""
    return Ramp(replace_altitude(reference, -1.0), rate, slow_below=SLOW_BELOW, landing=True)


def with_speed(guidance: FlyTo | Hold, speed: float) -> FlyTo | Hold:
    """The same guidance under another speed limit."""
    return replace(guidance, reference=guidance.reference._replace(speed=speed))
