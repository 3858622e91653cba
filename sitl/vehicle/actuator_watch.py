"""Watches that motors and elevons do as they are commanded: what turns the body beyond what the model explains.

Only rolling and yawing moments are watched: neither gusts nor a model that is 10 % wrong make nearly as much of them. A
pitching moment is the wing's as much as the elevons'. What an elevon at random does changes its sign too often to last,
so the rms of the rolling moment is watched too. A vehicle that flies on the truth knows what its actuators do.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy.typing as npt

from sitl.compiled import entry
from sitl.control.attitude_loop import momentum
from sitl.model.aerodynamics import wrench
from sitl.model.airframe import Airframe
from sitl.model.quaternions import rotate_inverse
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, add_scaled, cross, scaled, subtract
from sitl.storage import record_of, value_of, writer

BANDWIDTH = 5.0  # of the observer [rad/s]
YAW_SHARE = 0.9  # of a motor's thrust: with it a slow elevon, which can be flown, is told from one that fails
SHAKING_TIME = 0.5  # over which the rms is taken [s]
MAX_WATCH_STEP = 0.1  # a longer time between two looks was not watched [s]
_STILL = Vector(0.0, 0.0, 0.0)

Records = npt.NDArray[Any]


class UnexplainedMoment(NamedTuple):
    """Moments that the believed actuators do not explain, as shares of what a hover has of them."""

    roll: float = 0.0  # of elevons deflected fully against each other, in the slipstream
    yaw: float = 0.0  # of 90 % of one motor's thrust
    shaking: float = 0.0  # rms of the rolling moment of late, likewise


UNWATCHED = UnexplainedMoment()


class _Observer(NamedTuple):
    """State of the observer."""

    seen_at: float = -math.inf  # time of the last look [s]; minus infinity: none
    momentum: Vector = _STILL  # that the moments explain, body frame [N m s]
    moment: Vector = _STILL  # of the model at the last look, body frame [N m]


_put_observer = writer(_Observer, lambda observer: observer)


@entry
def _look(estimates: Records, airframes: Records, observers: Records, time: float) -> Vector:
    """Move the observer on to a time [s]; gives the moment that is unexplained, body frame [N m]."""
    estimate, a = value_of(estimates[0]), value_of(airframes[0])
    before, H = value_of(observers[0]), momentum(estimate.rates, a)
    through = rotate_inverse(estimate.attitude, subtract(estimate.velocity, estimate.wind))
    _, moment = wrench(through, estimate.rates, estimate.actuators, a)
    step = time - before.seen_at
    if step > MAX_WATCH_STEP:
        _put_observer(observers[0], _Observer(time, H, moment))
        return Vector(0.0, 0.0, 0.0)
    unexplained = scaled(subtract(H, before.momentum), BANDWIDTH)
    mean = scaled(add(before.moment, moment), 0.5)
    pull = add(subtract(mean, cross(estimate.rates, H)), unexplained)
    _put_observer(observers[0], _Observer(time, add_scaled(before.momentum, pull, step), moment))
    return unexplained


class ActuatorWatch:
    """The disturbance observer of :mod:`sitl.control.attitude_loop`, at the autopilot's pace.

    Args:
        airframe: The airframe as the vehicle believes it to be.
    """

    def __init__(self, airframe: Airframe) -> None:
        self._full = _hover_authority(airframe)
        self._airframes, self._observers = record_of(Airframe, airframe), record_of(_Observer, _Observer())
        self._mean_square, self._seen_at = 0.0, -math.inf  # of the share of the rolling moment; last look [s]

    def look(self, estimates: Records, time: float) -> UnexplainedMoment:
        """The unexplained moments at present, as shares of what a hover has of them.

        Args:
            estimates: Record of the :class:`Estimate` of a vehicle in the air, (1,).
            time: Now [s].
        """
        moment = _look(estimates, self._airframes, self._observers, time)
        roll, yaw = abs(moment.x) / self._full.roll, abs(moment.z) / self._full.yaw
        step, self._seen_at = time - self._seen_at, time
        before = self._mean_square if step <= MAX_WATCH_STEP else 0.0
        self._mean_square = before + (roll * roll - before) * min(step / SHAKING_TIME, 1.0)
        return UnexplainedMoment(roll, yaw, math.sqrt(self._mean_square))

    def stand(self) -> UnexplainedMoment:
        """Nothing is watched on the ground."""
        self._observers[0] = _Observer()
        self._mean_square, self._seen_at = 0.0, -math.inf
        return UNWATCHED


@lru_cache(maxsize=8)
def _hover_authority(a: Airframe) -> UnexplainedMoment:
    """Rolling moment of full elevons and yawing moment of 90 % of a motor's thrust in a still hover [N m]."""
    low, high = 0.0, float(a.omega_max)
    while low < (hovering := 0.5 * (low + high)) < high:
        force, _ = wrench(_STILL, _STILL, Actuators(hovering, hovering, 0.0, 0.0), a)
        low, high = (low, hovering) if force.x > a.m * a.g else (hovering, high)
    _, rolled = wrench(_STILL, _STILL, Actuators(hovering, hovering, a.delta_max, -a.delta_max), a)
    _, yawed = wrench(_STILL, _STILL, Actuators(hovering, 0.0, 0.0, 0.0), a)
    return UnexplainedMoment(abs(rolled.x), YAW_SHARE * abs(yawed.z))
