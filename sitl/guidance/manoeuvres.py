"""Manoeuvres: what turns a mode or a mission item into references for the control laws.

The autopilot asks the manoeuvre under way once per tick and gets a :class:`Reference`; time comes in with the
:class:`VehicleView`. World frame NWU, SI units, headings in radians about world z (from north towards west).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from sitl.control.reference import Point, Reference, at
from sitl.guidance.view import VehicleView

PASSING_DISTANCE, PASSING_SPEED = 0.2, 0.5  # at which a corner counts as passed [m], [m/s]
STOPPED_SPEED = 1.0  # slower than this counts as being at rest [m/s]


class Manoeuvre(Protocol):
    """One manoeuvre."""

    @property
    def landing(self) -> bool:
        """Whether touching the ground ends it."""

    def update(self, view: VehicleView) -> Reference:
        """The reference for this tick."""

    def done(self, view: VehicleView) -> bool:
        """Whether the manoeuvre is complete; to be called after ``update``."""


def distance(a: Point, b: Point) -> float:
    """Distance between two points [m]."""
    return math.dist(a, b)


@dataclass(slots=True)
class Hold:
    """Stay at a reference for ever."""

    reference: Reference
    landing: bool = False

    def update(self, view: VehicleView) -> Reference:  # noqa: ARG002 - the reference never moves
        """The reference."""
        return self.reference

    def done(self, view: VehicleView) -> bool:  # noqa: ARG002 - a hold has no end of its own
        """Never."""
        return False


@dataclass(slots=True)
class StayOnGround:
    """Wait on the ground, the motors idle."""

    reference: Reference
    hold: float  # [s]
    landing: bool = False
    began: float | None = None  # [s]

    def update(self, view: VehicleView) -> Reference:
        """The reference, which no law follows there."""
        self.began = view.time if self.began is None else self.began
        return self.reference

    def done(self, view: VehicleView) -> bool:
        """Waited long enough."""
        return self.began is not None and view.time - self.began >= self.hold


@dataclass(slots=True)
class ComeToRest:
    """Come to rest upright; how near the reference does not matter."""

    reference: Reference
    landing: bool = False

    def update(self, view: VehicleView) -> Reference:  # noqa: ARG002 - the reference never moves
        """The reference."""
        return self.reference

    def done(self, view: VehicleView) -> bool:
        """Upright and slow."""
        return not view.forward and math.hypot(*view.v) < STOPPED_SPEED


@dataclass(slots=True)
class FlyTo:
    """Go to a point and stay there for ``hold`` seconds within ``acceptance`` metres.

    The laws get the point itself, not a ramp towards it: covering the distance is the job of the hybrid controller.
    Only where a vertical speed was asked for, the height is a ramp.
    """

    reference: Reference
    acceptance: float
    hold: float = 0.0
    landing: bool = False
    arrived: float | None = None
    climb: float | None = None  # how fast the height rises [m/s]; None: at once
    descent: float | None = None  # how fast it falls [m/s]; None: at once
    ramped: tuple[float, float] | None = None  # time and height of the last tick, on a ramp

    def update(self, view: VehicleView) -> Reference:
        """The point; notes when the vehicle arrived."""
        near = distance(view.p, self.reference.position) <= self.acceptance
        if self.arrived is None and near and not view.forward:
            self.arrived = view.time
        if self.climb is None and self.descent is None:
            return self.reference
        return replace_altitude(self.reference, self._ramped_height(view))

    def _ramped_height(self, view: VehicleView) -> float:
        """The height for this tick, moved towards the point's from that of the last tick or of the vehicle [m]."""
        then, z = self.ramped or (view.time, view.p[2])
        wanted = self.reference.position.z - z
        up = wanted if self.climb is None else min(wanted, self.climb * (view.time - then))
        down = wanted if self.descent is None else max(wanted, -self.descent * (view.time - then))
        z += up if wanted > 0.0 else down
        self.ramped = (view.time, z)
        return z

    def done(self, view: VehicleView) -> bool:
        """Arrived, and held long enough since."""
        return self.arrived is not None and view.time - self.arrived >= self.hold


@dataclass(slots=True)
class PassBy:
    """Come near a point, slowly enough to turn there: a corner of a way that is hovered."""

    reference: Reference
    landing: bool = False

    def update(self, view: VehicleView) -> Reference:  # noqa: ARG002 - the reference never moves
        """The point."""
        return self.reference

    def done(self, view: VehicleView) -> bool:
        """Near, and slow."""
        return distance(view.p, self.reference.position) < PASSING_DISTANCE and math.hypot(*view.v) < PASSING_SPEED


@dataclass(slots=True)
class Ramp:
    """Move the reference straight up or down at a steady rate.

    A step in altitude would make the linear law push at its limits close to the ground.
    """

    reference: Reference  # where the ramp ends
    rate: float  # vertical speed, positive [m/s]
    landing: bool = False
    acceptance: float = 0.3
    began: tuple[float, float] | None = None  # time and altitude of the first tick

    def update(self, view: VehicleView) -> Reference:
        """The reference at this moment of the ramp."""
        if self.began is None:
            self.began = (view.time, view.p[2])
        since, start = self.began
        end = self.reference.position[2]
        way = self.rate * (view.time - since)
        return replace_altitude(self.reference, min(start + way, end) if end >= start else max(start - way, end))

    def done(self, view: VehicleView) -> bool:
        """At the end of the ramp."""
        return abs(view.p[2] - self.reference.position[2]) <= self.acceptance


@dataclass(slots=True)
class ManoeuvreSequence:
    """Several manoeuvres, one after the other: climb, go home, land."""

    steps: tuple[Manoeuvre, ...]
    index: int = 0

    @property
    def landing(self) -> bool:
        """Whether the present step is a landing."""
        return self.steps[self.index].landing

    def update(self, view: VehicleView) -> Reference:
        """The reference of the present step; moves on when that is done."""
        reference = self.steps[self.index].update(view)
        if self.steps[self.index].done(view) and self.index + 1 < len(self.steps):
            self.index += 1
            return self.steps[self.index].update(view)
        return reference

    def done(self, view: VehicleView) -> bool:
        """Whether the last step is done."""
        return self.index + 1 == len(self.steps) and self.steps[self.index].done(view)


def current_step(manoeuvre: Manoeuvre | None) -> Manoeuvre | None:
    """The manoeuvre itself, or the present step of a sequence."""
    while isinstance(manoeuvre, ManoeuvreSequence):
        manoeuvre = manoeuvre.steps[manoeuvre.index]
    return manoeuvre


def replace_altitude(reference: Reference, z: float) -> Reference:
    """The reference at another altitude."""
    return at(reference, (reference.position.x, reference.position.y, z))
