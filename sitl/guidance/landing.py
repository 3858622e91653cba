"""The descent to the ground: the vehicle stops and stands upright, and only then sinks.

Only a hovering vehicle may land. Once, a little above the ground, it waits for a gust to pass: what touches the ground
leaning or drifting is tripped by it. To wait again on the last way down (tried and dropped) makes the touch too soft to
be felt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl.control.reference import Point, Reference, at, upright
from sitl.guidance.view import MIN_HOLD_HEIGHT, VehicleView

SLOW_DESCENT_HEIGHT = 5.0  # below this, a landing descends at the set rate [m]
FAST_DESCENT_RATE = 1.5  # above it, at this one [m/s]
MAX_DESCENT_IN_WIND = 4.0  # the same times the wind: sinking faster, the wing turns it over [m2/s2]
BLIND_TIME = 2.0  # without a position for so long it drifts away, and how fast it does is not known [s]
BLIND_DESCENT_RATE, BLIND_PATIENCE = 2.0, 0.5  # then, in place of the others [m/s], [s]
LATE_HASTE, MAX_HASTE = 0.05, 0.4  # and faster by this, the farther under the ground it seems to be [1/m], at most
KNOWN_HEIGHT = 1.0  # deviation of a height beyond which the ground may be anywhere [m]
MAX_DESCENT_LEAD = 2.5  # of the reference below the vehicle: on the ground it presses no harder [m]
LANDING_TILT, LANDING_SPEED = math.radians(30.0), 1.0  # of a vehicle that has stopped [rad], [m/s]
LANDING_DISTANCE = 1.0  # from where it is going to land [m]
LANDING_PATIENCE = 8.0  # after waiting so long for it, all of this may be twice as much [s]
TOUCHING_HEIGHT, WAITING_HEIGHT = 0.9, 0.8  # below this it waits to be steady, at this height [m]
DESCENT_LAG = 1.0  # by which laws trail the descent [s]
TOUCHING_TILT, TOUCHING_SPEED = math.radians(8.0), 0.2  # of a vehicle that is [rad], [m/s]
STEADY_TIME = 0.5  # for so long [s]
TOUCHING_PATIENCE = 3.0  # after waiting so long there, both may be twice as much [s]
# What leans more than this near the ground stops sinking, as a vehicle that has begun to slip sideways while it sinks
# does so until it holds its height; on the last way down it goes up again to wait anew [rad].
LEANING_TILT = math.radians(10.0)
LEANING_PATIENCE, LEANT_PATIENCE = 15.0, 3.0  # after waiting so long low down, or on the way, twice as much [s]
MAX_TOUCHING_TILT = math.radians(14.0)  # on the last way down, however long it waited [rad]
MAX_DESCENT_STEP = 0.1  # a longer time since the last update counts as this [s]


def fast_descent_rate(view: VehicleView) -> float:
    """At which a vehicle that hovers may sink high above the ground [m/s].

    Sinking, it has air from behind along its wing, and a wind along the span makes the wing's forces large: past some
    product of the two a lean no longer moves it the way it leans.
    """
    wind = math.hypot(view.wind[0], view.wind[1])
    return min(FAST_DESCENT_RATE, MAX_DESCENT_IN_WIND / max(wind, 1.0))


@dataclass(slots=True)
class LandingDescent:
    """Stop over a place, stand upright, and sink through the ground: contact ends it. High up it sinks faster."""

    reference: Reference  # above the place; its altitude is that of the way there
    rate: float  # vertical speed near the ground [m/s]
    anywhere: bool = False  # where the vehicle comes to stand will do
    sinks: bool = False
    waited: float = 0.0  # for the vehicle to stand, then to be steady [s]
    steady: float = 0.0  # for how long it has been, near the ground [s]
    leant: float = 0.0  # for how long it has waited to stand upright again [s]
    is_low: bool = False  # has waited to be steady
    looked_at: float | None = None  # [s]

    @property
    def landing(self) -> bool:
        """Whether touching the ground ends it: before it stands upright, nothing is a landing."""
        return self.sinks

    def update(self, view: VehicleView) -> Reference:
        """The reference of this tick."""
        passed = 0.0 if self.looked_at is None else min(max(view.time - self.looked_at, 0.0), MAX_DESCENT_STEP)
        self.looked_at = view.time
        if self.sinks:
            self._sink(view, passed)
        elif self._stands(view):
            self._begin(view)
        else:
            self.waited += passed
        return self.reference

    def done(self, view: VehicleView) -> bool:  # noqa: ARG002 - the ground ends it
        """Never."""
        return False

    def _stands(self, view: VehicleView) -> bool:
        """Whether it has stopped upright where it is going to land."""
        allowed, to = 1.0 + self.waited / LANDING_PATIENCE, self.reference.position
        off = 0.0 if self.anywhere else math.dist(view.p[:2], to[:2])
        slow = math.hypot(*view.v) <= LANDING_SPEED * allowed
        return slow and view.tilt <= LANDING_TILT * allowed and off <= LANDING_DISTANCE * allowed

    def _is_steady(self, view: VehicleView) -> bool:
        allowed = 1.0 + self.waited / (BLIND_PATIENCE if _is_blind(view) else TOUCHING_PATIENCE)
        return view.tilt <= TOUCHING_TILT * allowed and math.hypot(*view.v[:2]) <= TOUCHING_SPEED * allowed

    def _begin(self, view: VehicleView) -> None:
        self.sinks, self.waited = True, 0.0
        x, y, _ = view.p if self.anywhere else self.reference.position
        self.reference = at(self.reference, (x, y, view.p[2]))

    def _sink(self, view: VehicleView, passed: float) -> None:
        """Move the reference down: what leans waits to stand upright, and once near the ground to be steady."""
        z, blind = self.reference.position.z, _is_blind(view)
        has_height = not blind or view.height_deviation <= KNOWN_HEIGHT
        leans = self._leans(view) and not blind
        if self.is_low and leans:
            self.is_low, self.steady = False, 0.0
        if not self.is_low and has_height and view.p[2] <= TOUCHING_HEIGHT:
            self._wait_low(view, passed)
        elif leans and z < SLOW_DESCENT_HEIGHT:
            self.leant += passed
            self._move_to_height(view.p[2])
        elif not has_height:
            haste = _haste(view)
            fallen = BLIND_DESCENT_RATE * haste * passed
            self._move_to_height(max(z - fallen, view.p[2] - MAX_DESCENT_LEAD * haste))
        else:
            self._move_to_height(max(z - self._descended(view, z, passed), view.p[2] - MAX_DESCENT_LEAD))

    def _move_to_height(self, z: float) -> None:
        x, y, _ = self.reference.position
        self.reference = at(self.reference, (x, y, z))

    def _leans(self, view: VehicleView) -> bool:
        allowed = LEANING_TILT * (1.0 + self.waited / LEANING_PATIENCE + self.leant / LEANT_PATIENCE)
        return view.tilt > (min(allowed, MAX_TOUCHING_TILT) if self.is_low else allowed)

    def _wait_low(self, view: VehicleView, passed: float) -> None:
        """Wait to be steady; then straight down from here, as what moves sideways is tripped by the ground."""
        self.waited += passed
        self.steady = self.steady + passed if self._is_steady(view) else 0.0
        self.is_low = self.steady >= STEADY_TIME or (_is_blind(view) and self.steady > 0.0)
        x, y, _ = view.p if self.is_low else self.reference.position
        height = view.p[2] - DESCENT_LAG * self.rate if self.is_low else WAITING_HEIGHT
        self.reference = at(self.reference, (x, y, height))

    def _descended(self, view: VehicleView, z: float, passed: float) -> float:
        """Distance that the reference at a height sinks in some time [m]."""
        rate = BLIND_DESCENT_RATE if _is_blind(view) else max(fast_descent_rate(view), self.rate)
        fast = min(rate * passed, max(z - SLOW_DESCENT_HEIGHT, 0.0))
        return fast + self.rate * (passed - fast / rate)


def _is_blind(view: VehicleView) -> bool:
    return view.position_age > BLIND_TIME


def _haste(view: VehicleView) -> float:
    """Factor of a descent without height: where the ground is late, the vehicle sinks more slowly than it believes."""
    return 1.0 + min(LATE_HASTE * max(-view.p[2], 0.0), MAX_HASTE)


# Off the ground straight up: nothing moves sideways near it.


CLEAR_MARGIN = 0.3  # below the least height of a hold, the way sideways begins [m]
STRAIGHT_UP = 0.5  # a reference nearer than this leads straight up anyway [m]
MAX_RISE_STEP = 0.1  # longest time that the reference rises at once [s]


@dataclass(slots=True)
class LiftOff:
    """Keeps the reference above where the vehicle stood until it is clear of the ground; one for a vehicle."""

    _stood: Point | None = None  # where the flight began; None: it is clear of the ground
    _up: float = 0.0  # how high the reference has risen [m]
    _time: float = 0.0  # of the last tick [s]

    def applied(self, reference: Reference, view: VehicleView, climb_rate: float, *, landing: bool) -> Reference:
        """The reference of this tick.

        Args:
            reference: Where the vehicle is to go.
            view: The vehicle as it is now.
            climb_rate: How fast it rises [m/s].
            landing: Whether it is going to stand on the ground.
        """
        passed = min(max(view.time - self._time, 0.0), MAX_RISE_STEP)
        self._time = view.time
        if view.landed:
            self._stood, self._up = view.p, view.p[2]
        elif landing or view.p[2] >= MIN_HOLD_HEIGHT - CLEAR_MARGIN:
            self._stood = None
        if self._stood is None or reference.steered:
            return reference
        x, y, _ = self._stood
        to = reference.position
        if not reference.forward and math.hypot(to.x - x, to.y - y) < STRAIGHT_UP:
            return reference
        self._up += climb_rate * passed
        return at(upright(reference), (x, y, min(self._up, max(to.z, MIN_HOLD_HEIGHT))))
