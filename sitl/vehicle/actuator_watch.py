"""Watches that motors and elevons do as they are commanded: what turns the body beyond what the model explains.

Only rolling and yawing moments are watched: neither gusts nor a model that is 10 % wrong make nearly as much of them. A
pitching moment is the wing's as much as the elevons'. A vehicle that flies on the truth knows what its actuators do.
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.control.estimate import Estimate
from sitl.control.moment_observer import momentum
from sitl.model.aerodynamics import wrench
from sitl.model.airframe import Airframe
from sitl.model.quaternions import rotate_inverse
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, add_scaled, cross, scaled, subtract

BANDWIDTH = 5.0  # of the observer [rad/s]
YAW_SHARE = 0.9  # of a motor's thrust: with it a slow elevon, which can be flown, is told from one that fails
MAX_WATCH_STEP = 0.1  # a longer time between two looks was not watched [s]


class UnexplainedMoment(NamedTuple):
    """Moments that the believed actuators do not explain, as shares of what a hover has of them."""

    roll: float = 0.0  # of elevons deflected fully against each other, in the slipstream
    yaw: float = 0.0  # of 90 % of one motor's thrust


class ActuatorWatch:
    """The disturbance observer of :mod:`sitl.control.moment_observer`, at the autopilot's pace.

    Args:
        airframe: The airframe as the vehicle believes it to be.
    """

    def __init__(self, airframe: Airframe) -> None:
        self._airframe = airframe
        self._full = _hover_authority(airframe)
        self._seen_at: float | None = None
        self._state = self._moment = Vector(0.0, 0.0, 0.0)  # momentum that the moments explain [N m s]; moment [N m]

    def look(self, estimate: Estimate, time: float) -> UnexplainedMoment:
        """What is unexplained now.

        Args:
            estimate: Of the vehicle in the air.
            time: Now [s].
        """
        a, H = self._airframe, momentum(estimate.rates, self._airframe)
        through = rotate_inverse(estimate.attitude, subtract(estimate.velocity, estimate.wind))
        _, moment = wrench(through, estimate.rates, estimate.actuators, a)
        step = MAX_WATCH_STEP + 1.0 if self._seen_at is None else time - self._seen_at
        self._seen_at, before, self._moment = time, self._moment, moment
        if step > MAX_WATCH_STEP:
            self._state = H
            return UnexplainedMoment()
        unexplained = scaled(subtract(H, self._state), BANDWIDTH)
        mean = scaled(add(before, moment), 0.5)
        pull = add(subtract(mean, cross(estimate.rates, H)), unexplained)
        self._state = add_scaled(self._state, pull, step)
        return UnexplainedMoment(abs(unexplained.x) / self._full.roll, abs(unexplained.z) / self._full.yaw)

    def stand(self) -> UnexplainedMoment:
        """Nothing is watched on the ground."""
        self._seen_at = None
        return UnexplainedMoment()


def _hover_authority(a: Airframe) -> UnexplainedMoment:
    """Rolling moment of full elevons and yawing moment of 90 % of a motor's thrust in a still hover [N m]."""
    still = Vector(0.0, 0.0, 0.0)

    low, high = 0.0, float(a.omega_max)
    while low < (hovering := 0.5 * (low + high)) < high:
        force, _ = wrench(still, still, Actuators(hovering, hovering, 0.0, 0.0), a)
        low, high = (low, hovering) if force.x > a.m * a.g else (hovering, high)
    _, rolled = wrench(still, still, Actuators(hovering, hovering, a.delta_max, -a.delta_max), a)
    _, yawed = wrench(still, still, Actuators(hovering, 0.0, 0.0, 0.0), a)
    return UnexplainedMoment(abs(rolled.x), YAW_SHARE * abs(yawed.z))
