"""Flights of the linear hover law alone, from random states or steps of the target.

The plant is the whole one: its actuators have their limits, and commands act one period late. A flight has converged
once its V is below a given level with eta > 0, a level from which convergence is proved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from sitl import (
    PERIOD,
    Actuators,
    Airframe,
    Array,
    Body,
    Estimate,
    Plant,
    Quaternion,
    Reference,
    Vector,
    hover_at,
    kernel,
)
from sitl.compiled import entry
from sitl.control import hover_linear
from sitl.control.attitude_loop import NOT_CHOSEN
from sitl.control.estimate import Ages
from sitl.control.hover_linear import SQRT_HALF, HoverError, LinearGains, LinearState
from sitl.model.actuators import limited, limits
from sitl.model.arithmetic import sine_cosine
from sitl.model.ground import feet_aloft
from sitl.model.plant import step_in_air
from sitl.model.propeller import speed_for
from sitl.model.quaternions import hover, multiply
from sitl.model.vectors import add, norm
from sitl.simulation.flight import SUBSTEPS

Flags: TypeAlias = npt.NDArray[np.bool_]

V_BANDS = (0.0, 20.0, 50.0, 100.0, 150.0, 250.0, 400.0)  # edges; a flight belongs to the band of its start
MAX_FLIGHT_TIME = 20.0  # [s]
HOVER_TARGET = Vector(0.0, 0.0, 10_000.0)  # far above the ground [m]
START_ENVELOPE = (17.0, 5.0, math.radians(90.0), 3.0)  # position [m], speed [m/s], turn [rad], rates [rad/s]
LOST_V = 1e6  # a flight beyond this V is lost
SETTLED_RADIUS = 0.05  # a step has settled when it stays within this [m]
STEP_SIZES = (0.5, 1.0, 2.0, 4.0, 8.0)  # [m]
V_RIPPLE = 1e-6  # relative change of V that is rounding, not a rise
POSITION_LIMITS = 15  # DARKO_LIMIT bits of actuators at a position limit
NO_MOTION = Vector(0.0, 0.0, 0.0)


class StartState(NamedTuple):
    """A state that a flight starts from."""

    body: Body  # position relative to the target, whose heading is 0
    level: float  # V
    band: int  # of V, an index of the bands


class RegionFlight(NamedTuple):
    """Result of one flight."""

    converged: bool
    monotone: bool  # V never rose
    periods: int  # flown
    limited: int  # periods with an actuator at a position limit
    settled: int  # the last period beyond SETTLED_RADIUS


class RegionFlights(NamedTuple):
    """One entry per flight."""

    start: Array  # V
    band: npt.NDArray[np.int64]  # of V at the start
    upright: Flags  # eta > 0; x alone cannot distinguish the two signs
    converged: Flags
    monotone: Flags  # V of the law's own S never rose
    time: Array  # until convergence [s]; NaN if it did not converge
    saturated: Array  # share of the flight with an actuator at a position limit


def draw(S: Array, count: int, seed: int, *, envelope: bool, bands: Sequence[float] = V_BANDS) -> list[StartState]:
    """Random states, the same number for each band of V = x' S x, band after band.

    Args:
        S: Of V, (12, 12).
        count: Minimum number of states; rounded up to a multiple of the number of bands.
        seed: Of the draw.
        envelope: Whether to draw states that another law can hand over (see :func:`_from_envelope`), or states uniform
            in direction on level sets of V, whose rates reach 6 sqrt(V) rad/s.
        bands: Edges of the bands of V.
    """
    random = np.random.default_rng(seed)
    to_x = np.linalg.inv(np.linalg.cholesky(S))
    share = math.ceil(count / (len(bands) - 1))
    by_band: list[list[StartState]] = [[] for _ in bands[1:]]
    while min(len(states) for states in by_band) < share:
        body = _from_envelope(random) if envelope else _from_level_set(random, to_x, bands[-1])
        level = float(hover_linear.quadratic(deviation(body), S))
        band = int(np.searchsorted(bands, level, side="right")) - 1
        if 0 <= band < len(by_band) and len(by_band[band]) < share:
            by_band[band].append(StartState(body, level, band))
    return [state for states in by_band for state in states]


def _from_level_set(random: np.random.Generator, to_x: Array, highest: float) -> Body:
    """A state uniform in direction on the level set of a V uniform up to the highest.

    Only where it belongs to an attitude: x holds eps alone, |eps| <= 1. Where both signs of eta agree with the law's
    choice of the sign of q, one is drawn.
    """
    while True:
        y = random.standard_normal(12)
        x = math.sqrt(random.uniform(0.0, highest)) / np.linalg.norm(y) * y @ to_x
        eps = x[6:9] - (0.0, SQRT_HALF, 0.0)
        eta = math.sqrt(max(1.0 - float(eps @ eps), 0.0)) * (1.0 if random.random() < 0.5 else -1.0)
        if eps @ eps < 1.0 and eta > eps[1]:
            return Body(_vector(x[:3]), _vector(x[3:6]), Quaternion(eta, *_vector(eps)), _vector(x[9:]))


def _from_envelope(random: np.random.Generator) -> Body:
    """A state within START_ENVELOPE of the hover: position, velocity, turn and rates in random directions."""
    position, velocity, turn, rates = (
        _vector(random.uniform(0.0, maximum) * direction / np.linalg.norm(direction))
        for maximum, direction in zip(START_ENVELOPE, random.standard_normal((4, 3)), strict=True)
    )
    angle = norm(turn)
    s, c = sine_cosine(0.5 * angle)
    k = s / max(angle, 1e-12)
    attitude = multiply(hover(0.0), Quaternion(c, k * turn.x, k * turn.y, k * turn.z))
    return Body(position, velocity, attitude, rates)


def _vector(x: Array) -> Vector:
    return Vector(*(float(part) for part in x))


def deviation(body: Body) -> HoverError:
    """The error x that the law computes for a body relative to its target, heading 0."""
    return hover_linear.error(_estimate(body, Actuators(0.0, 0.0, 0.0, 0.0)), NO_MOTION, 0.0)


@kernel
def _estimate(body: Body, actuators: Actuators) -> Estimate:
    """A perfect estimate, in still air and far above the ground."""
    fresh = Ages(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Estimate(
        body.position, body.velocity, NO_MOTION, body.attitude, body.rates, NO_MOTION, actuators, False, fresh
    )


@kernel
def is_upright(q: Quaternion) -> bool:
    """Whether eta > 0 for the sign of q that the law uses."""
    return (q.w if q.w >= q.y else -q.w) > 0.0


def fly(a: Airframe, gains: LinearGains, states: Sequence[StartState], converged_v: float) -> RegionFlights:
    """Fly states under the linear law alone in still air, target and heading zero.

    Args:
        a: The airframe.
        gains: The law.
        states: From :func:`draw`.
        converged_v: The law's own V below which, with eta > 0, the flight has converged.
    """
    flown = [flight(a, gains, state.body, converged_v) for state in states]
    periods = np.array([one.periods for one in flown], dtype=np.float64)
    converged = np.array([one.converged for one in flown])
    return RegionFlights(
        start=np.array([state.level for state in states]),
        band=np.array([state.band for state in states]),
        upright=np.array([is_upright(state.body.attitude) for state in states]),
        converged=converged,
        monotone=np.array([one.monotone for one in flown]),
        time=np.where(converged, periods * PERIOD, math.nan),
        saturated=np.array([one.limited for one in flown]) / np.maximum(periods, 1.0),
    )


def steps(a: Airframe, gains: LinearGains) -> Array:
    """Settling times of position steps, (step size, axis north, west or up) [s]; NaN if a step does not settle."""
    times = np.empty((len(STEP_SIZES), 3))
    for row, size in enumerate(STEP_SIZES):
        for axis in range(3):
            flown = flight(a, gains, _offset(size, axis), -1.0)
            settled = flown.settled < flown.periods == round(MAX_FLIGHT_TIME / PERIOD)
            times[row, axis] = flown.settled * PERIOD if settled else math.nan
    return times


def decay_seen(a: Airframe, gains: LinearGains) -> float:
    """Mean rate alpha of V ~ exp(-2 alpha t) over four decades of V, smallest step, slowest axis [1/s]."""
    rates = []
    for axis in range(3):
        body = _offset(STEP_SIZES[0], axis)
        flown = flight(a, gains, body, 1e-4 * hover_linear.quadratic(deviation(body), gains.S))
        rates.append(0.5 * math.log(1e4) / (flown.periods * PERIOD) if flown.converged else 0.0)
    return min(rates)


def _offset(size: float, axis: int) -> Body:
    """At rest at this distance from the target along an axis."""
    away = [0.0, 0.0, 0.0]
    away[axis] = -size
    return Body(Vector(*away), NO_MOTION, hover(0.0), NO_MOTION)


def flight(a: Airframe, gains: LinearGains, body: Body, converged_v: float) -> RegionFlight:
    """One flight, from a body relative to its target; arguments as for :func:`fly`."""
    start = body._replace(position=add(body.position, HOVER_TARGET))
    target = hover_at(HOVER_TARGET, 0.0, math.inf)  # V is the law's without the limit of the hover's speed
    return _descend(start, gains, a, target, round(MAX_FLIGHT_TIME / PERIOD), float(converged_v))


@entry
def _descend(
    start: Body, gains: LinearGains, a: Airframe, reference: Reference, periods: int, converged_v: float
) -> RegionFlight:
    """Fly until V <= ``converged_v`` with eta > 0, V exceeds LOST_V or the time is up; the period is the vehicle's."""
    motor, dt = speed_for(gains.u_bar.T1, 0.0, a), PERIOD / SUBSTEPS
    command = Actuators(motor, motor, 0.0, 0.0)
    plant, state = Plant(start, command, feet_aloft()), LinearState(Vector(0.0, 0.0, 0.0), NOT_CHOSEN)
    estimate = _estimate(start, command)
    before, monotone, at_limit, settled = hover_linear.lyapunov(estimate, reference, gains), True, 0, 0
    for k in range(periods):
        if before <= converged_v and is_upright(estimate.attitude):
            return RegionFlight(True, monotone, k, at_limit, settled)
        wanted, _, state = hover_linear.step(estimate, reference, gains, a, state, PERIOD)
        at_limit += 1 if limits(plant.actuators, command, True, dt, a) & POSITION_LIMITS else 0
        in_force = limited(command, True, a)
        for _ in range(SUBSTEPS):
            plant = step_in_air(plant, in_force, NO_MOTION, a, dt)
        command, estimate = wanted, _estimate(plant.body, plant.actuators)
        x = hover_linear.error(estimate, reference.position, reference.heading)
        now = hover_linear.quadratic(x, gains.S)
        settled = k + 1 if norm(x.position) > SETTLED_RADIUS else settled
        if not now < LOST_V:
            return RegionFlight(False, False, k + 1, at_limit, settled)
        monotone = monotone and now <= before * (1.0 + V_RIPPLE)
        before = now
    return RegionFlight(False, monotone, periods, at_limit, settled)
