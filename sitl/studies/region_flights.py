"""Flights of the linear hover law alone, from random states or steps of the target.

The plant is whole: its actuators have their limits, and commands are in force one period late. A flight has converged
once its V is below a given level with eta > 0: one that is proved, from which nothing is lost.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from sitl.compiled import entry, kernel
from sitl.control import hover_linear
from sitl.control.estimate import Ages, Estimate
from sitl.control.hover_linear import HALF, HoverError, LinearGains
from sitl.control.reference import Reference, hover_at
from sitl.model.actuators import limited, limits
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import sine_cosine
from sitl.model.ground import feet_aloft
from sitl.model.plant import step_in_air
from sitl.model.quaternions import Quaternion, hover, multiply
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import Vector, add, norm
from sitl.simulation.flight import PERIOD, SUBSTEPS

Flags: TypeAlias = npt.NDArray[np.bool_]

BANDS = (0.0, 20.0, 50.0, 100.0, 150.0, 250.0, 400.0)  # of V; a flight's band is where it starts
DURATION = 20.0  # of a flight at most [s]
ALOFT = Vector(0.0, 0.0, 10_000.0)  # where a flight is to end, out of the ground's reach [m]
ENVELOPE = (17.0, 5.0, math.radians(90.0), 3.0)  # position [m], speed [m/s], turn [rad], rates [rad/s]
LOST = 1e6  # a V from which nothing came back
RADIUS = 0.05  # a step has settled within this [m]
STEPS = (0.5, 1.0, 2.0, 4.0, 8.0)  # [m]
RIPPLE = 1e-6  # of V, relative: rounding, not a rise
POSITION_LIMITS = 15  # the DARKO_LIMIT bits of positions
STILL = Vector(0.0, 0.0, 0.0)


class Drawn(NamedTuple):
    """A state to fly from."""

    body: Body  # its position relative to the target, which has heading 0
    level: float  # V
    band: int  # of V, an index of the bands


class Descent(NamedTuple):
    """How one flight went."""

    converged: bool
    monotone: bool  # V never rose
    periods: int  # flown
    limited: int  # periods with an actuator at a position limit
    settled: int  # the last period beyond RADIUS


class Flights(NamedTuple):
    """One entry per flight."""

    start: Array  # V
    band: npt.NDArray[np.int64]  # of V at the start
    upright: Flags  # eta > 0: on the hover's side of what x cannot tell apart
    converged: Flags
    monotone: Flags  # V of the law's own S never rose
    time: Array  # to the proved set [s]; NaN if it did not converge
    saturated: Array  # share of the flight with an actuator at a position limit


def draw(S: Array, count: int, seed: int, *, envelope: bool, bands: Sequence[float] = BANDS) -> list[Drawn]:
    """Random states, equally many for each band of V = x' S x, band after band.

    Args:
        S: Of V, (12, 12).
        count: How many states, at least; rounded up to a multiple of the bands.
        seed: Of the draw.
        envelope: Whether to draw what a flight can hand over (see :func:`_from_envelope`), or uniformly in direction
            on level sets of V, where rates reach 6 sqrt(V) rad/s.
        bands: Edges of the bands of V.
    """
    random = np.random.default_rng(seed)
    to_x = np.linalg.inv(np.linalg.cholesky(S))
    share = math.ceil(count / (len(bands) - 1))
    kept: list[list[Drawn]] = [[] for _ in bands[1:]]
    while min(len(states) for states in kept) < share:
        body = _from_envelope(random) if envelope else _from_level_set(random, to_x, bands[-1])
        level = float(hover_linear.quadratic(deviation(body), S))
        band = int(np.searchsorted(bands, level, side="right")) - 1
        if 0 <= band < len(kept) and len(kept[band]) < share:
            kept[band].append(Drawn(body, level, band))
    return [state for states in kept for state in states]


def _from_level_set(random: np.random.Generator, to_x: Array, highest: float) -> Body:
    """A state uniform in direction on the level set of a V uniform up to the highest.

    That is as far as it has attitudes: x holds eps alone, |eps| <= 1. Where both signs of eta agree with the law's
    choice of the sign of q either is taken.
    """
    while True:
        y = random.standard_normal(12)
        x = math.sqrt(random.uniform(0.0, highest)) / np.linalg.norm(y) * y @ to_x
        eps = x[6:9] - (0.0, HALF, 0.0)
        eta = math.sqrt(max(1.0 - float(eps @ eps), 0.0)) * (1.0 if random.random() < 0.5 else -1.0)
        if eps @ eps < 1.0 and eta > eps[1]:
            return Body(_vector(x[:3]), _vector(x[3:6]), Quaternion(eta, *_vector(eps)), _vector(x[9:]))


def _from_envelope(random: np.random.Generator) -> Body:
    """A state within ENVELOPE of the hover: position, velocity, turn and rates in random directions."""
    position, velocity, turn, rates = (
        _vector(random.uniform(0.0, greatest) * direction / np.linalg.norm(direction))
        for greatest, direction in zip(ENVELOPE, random.standard_normal((4, 3)), strict=True)
    )
    angle = norm(turn)
    s, c = sine_cosine(0.5 * angle)
    k = s / max(angle, 1e-12)
    attitude = multiply(hover(0.0), Quaternion(c, k * turn.x, k * turn.y, k * turn.z))
    return Body(position, velocity, attitude, rates)


def _vector(x: Array) -> Vector:
    return Vector(*(float(part) for part in x))


def deviation(body: Body) -> HoverError:
    """The x that the law sees of a body relative to its target, heading 0."""
    return hover_linear.error(_estimate(body, Actuators(0.0, 0.0, 0.0, 0.0)), STILL, 0.0)


@kernel
def _estimate(body: Body, actuators: Actuators) -> Estimate:
    """All that is so, in still air and out of the ground's reach."""
    fresh = Ages(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Estimate(body.position, body.velocity, STILL, body.attitude, body.rates, STILL, actuators, False, fresh)


@kernel
def is_upright(q: Quaternion) -> bool:
    """Whether eta > 0 in the sign of q that the law takes."""
    return (q.w if q.w >= q.y else -q.w) > 0.0


def fly(a: Airframe, gains: LinearGains, states: Sequence[Drawn], caught: float) -> Flights:
    """Fly states under the linear law alone in still air, target and heading zero.

    Args:
        a: The airframe.
        gains: The law.
        states: Of :func:`draw`.
        caught: Level of the law's own V that is proved: below it, with eta > 0, the flight has converged.
    """
    flown = [flight(a, gains, state.body, caught) for state in states]
    periods = np.array([one.periods for one in flown], dtype=np.float64)
    converged = np.array([one.converged for one in flown])
    return Flights(
        start=np.array([state.level for state in states]),
        band=np.array([state.band for state in states]),
        upright=np.array([is_upright(state.body.attitude) for state in states]),
        converged=converged,
        monotone=np.array([one.monotone for one in flown]),
        time=np.where(converged, periods * PERIOD, math.nan),
        saturated=np.array([one.limited for one in flown]) / np.maximum(periods, 1.0),
    )


def steps(a: Airframe, gains: LinearGains) -> Array:
    """Settling times within RADIUS of position steps, (steps, axes) as STEPS and north, west, up [s]; NaN: not."""
    times = np.empty((len(STEPS), 3))
    for row, size in enumerate(STEPS):
        for axis in range(3):
            flown = flight(a, gains, _offset(size, axis), -1.0)
            settled = flown.settled < flown.periods == round(DURATION / PERIOD)
            times[row, axis] = flown.settled * PERIOD if settled else math.nan
    return times


def decay_seen(a: Airframe, gains: LinearGains) -> float:
    """Mean rate alpha of V ~ exp(-2 alpha t) over four decades of V, smallest step, slowest axis [1/s]."""
    rates = []
    for axis in range(3):
        body = _offset(STEPS[0], axis)
        flown = flight(a, gains, body, 1e-4 * hover_linear.quadratic(deviation(body), gains.S))
        rates.append(0.5 * math.log(1e4) / (flown.periods * PERIOD) if flown.converged else 0.0)
    return min(rates)


def _offset(size: float, axis: int) -> Body:
    """At rest this far from the target along an axis."""
    away = [0.0, 0.0, 0.0]
    away[axis] = -size
    return Body(Vector(*away), STILL, hover(0.0), STILL)


def flight(a: Airframe, gains: LinearGains, body: Body, caught: float) -> Descent:
    """One flight, from a body relative to its target; arguments as for :func:`fly`."""
    start = body._replace(position=add(body.position, ALOFT))
    return _descend(start, gains, a, hover_at(ALOFT, 0.0), round(DURATION / PERIOD), float(caught))


@entry
def _descend(
    start: Body, gains: LinearGains, a: Airframe, reference: Reference, periods: int, caught: float
) -> Descent:
    """Fly until V <= ``caught`` with eta > 0, V is beyond hope or the time is up; a period is as the vehicle's."""
    motor, dt = math.sqrt(gains.u_bar.T1 / a.k_f), PERIOD / SUBSTEPS
    command = Actuators(motor, motor, 0.0, 0.0)
    plant, integral = Plant(start, command, feet_aloft()), Vector(0.0, 0.0, 0.0)
    estimate = _estimate(start, command)
    before, monotone, at_limit, settled = hover_linear.lyapunov(estimate, reference, gains), True, 0, 0
    for k in range(periods):
        if before <= caught and is_upright(estimate.attitude):
            return Descent(True, monotone, k, at_limit, settled)
        wanted, _, integral = hover_linear.step(estimate, reference, gains, a, integral, PERIOD)
        at_limit += 1 if limits(plant.actuators, command, True, dt, a) & POSITION_LIMITS else 0
        in_force = limited(command, True, a)
        for _ in range(SUBSTEPS):
            plant = step_in_air(plant, in_force, STILL, a, dt)
        command, estimate = wanted, _estimate(plant.body, plant.actuators)
        x = hover_linear.error(estimate, reference.position, reference.heading)
        now = hover_linear.quadratic(x, gains.S)
        settled = k + 1 if norm(x.position) > RADIUS else settled
        if not now < LOST:
            return Descent(False, False, k + 1, at_limit, settled)
        monotone = monotone and now <= before * (1.0 + RIPPLE)
        before = now
    return Descent(False, monotone, periods, at_limit, settled)
