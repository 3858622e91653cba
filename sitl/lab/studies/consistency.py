"""Whether the navigation filter is as wrong as it says: NEES and NIS over many seeds.

The *normalised estimation error squared* of n errors is chi-squared with n degrees of freedom if the covariance is
right; its mean over N flights then lies within the chi-squared bounds of n N degrees, divided by N (Bar-Shalom, Li
and Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 5.4). Errors are judged where the filter
stands, at its horizon.
"""

from __future__ import annotations

import argparse
import enum
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from sitl import Array, Law, Plant, Simulation, SitlError, Start, Vector, along, hover_at, leg
from sitl.estimation.nominal_state import WIND_ERROR
from sitl.lab.studies.seeded_flights import (
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    ignore_progress,
    print_progress,
    write_json,
)
from sitl.lab.studies.wrong_models import UNCERTAIN, perturbed
from sitl.model.quaternions import conjugate, multiply, rotate_inverse
from sitl.model.vectors import add, cross, subtract
from sitl.storage import copy_of

JUDGED_HEIGHT = 60.0  # [m]
WINDS = (3.0, 3.0, 0.3)  # deviation of the steady wind, as the filter expects it, world NWU [m/s]
GUSTS = 0.5  # rms per axis [m/s]
JUDGED_LEG, JUDGED_AIRSPEED = 900.0, 15.0  # [m], [m/s]
STOP_AT, STOP_AFTER = 150.0, 10.0  # of the flight with transitions [m], [s]
FIRST_LOOK, SECONDS, EVERY_PERIODS = 5.0, 30.0, 500  # first look and end [s], control periods between two looks
MODEL_ERROR = 0.1  # how far a wrong model's constants are off, either way by turns
# What is judged: all errors (position, velocity, attitude, both inertial biases, wind), without the wind, and the wind.
ALL_ERRORS, NAVIGATION, WIND = slice(0, WIND_ERROR + 3), slice(0, WIND_ERROR), slice(WIND_ERROR, WIND_ERROR + 3)
JUDGED = (ALL_ERRORS, NAVIGATION, WIND)
LINE_NAMES = ("magnetometer", "barometer", "GNSS", "pitot", "motion capture", "external pose", "wing")
# the last is no line: what the accelerometer feels across the wing


class Phase(enum.Enum):
    """Phase of flight in which the filter is judged."""

    HOVER = "hover"
    TRANSITION = "transitions"
    CRUISE = "cruise"


class ConsistencyDraw(NamedTuple):
    """One flight."""

    seed: int
    phase: Phase
    wrong: bool  # whether the design model is 10 % off
    gusts: float = GUSTS  # rms per axis [m/s]


class ConsistencyFlight(NamedTuple):
    """Consistency of the filter in one flight."""

    draw: ConsistencyDraw
    nees: Array  # of what is JUDGED at each look, (k, 3)
    squared: Array  # errors of position, velocity and attitude squared, mean of the looks, (9,)
    said: Array  # what the filter said of them, (9,)
    squares: Array  # sum of squared innovations over their variances between two looks, per line, (k - 1, 7)
    scalars: Array  # how many were summed, (k - 1, 7)


def fly(draw: ConsistencyDraw, craft: Craft) -> ConsistencyFlight:
    """Fly one draw and look at the filter."""
    model = craft.model
    scale = {name: 1.0 + MODEL_ERROR * (1 if k % 2 == draw.seed % 2 else -1) for k, name in enumerate(UNCERTAIN)}
    airframe = perturbed(model, scale) if draw.wrong else model
    vehicle = craft.fly(draw.seed, Start(up=JUDGED_HEIGHT, airborne=True), airframe)
    drawn = np.random.default_rng((draw.seed, 5)).standard_normal(3) * WINDS
    vehicle.set_wind(Vector(*(float(part) for part in drawn)), draw.gusts)
    vehicle.begin_flight(Law.HOVER_ZERO_MOMENT)
    hold = hover_at((0.0, 0.0, JUDGED_HEIGHT), 0.0)
    path = leg((0.0, 0.0, JUDGED_HEIGHT), (JUDGED_LEG, 0.0, JUDGED_HEIGHT), JUDGED_AIRSPEED)
    vehicle.reference = hold if draw.phase is Phase.HOVER else along(hold, path, 0.0)
    return _watched(vehicle, draw)


def _watched(vehicle: Simulation, draw: ConsistencyDraw) -> ConsistencyFlight:
    looks, counted = [], []
    while vehicle.time < SECONDS:
        if draw.phase is Phase.TRANSITION and vehicle.time >= STOP_AFTER and vehicle.reference.forward:
            vehicle.reference = hover_at((STOP_AT, 0.0, JUDGED_HEIGHT), 0.0)
        if vehicle.time >= FIRST_LOOK:
            looks.append(_look(vehicle))
            f = vehicle.avionics.filter
            counted.append((np.array(f.squares), np.array(f.scalars)))
        vehicle.advance(EVERY_PERIODS - vehicle.periods % EVERY_PERIODS)
    squares, scalars = (np.diff([count[k] for count in counted], axis=0) for k in (0, 1))
    nees, errors, variances = (np.array([look[k] for look in looks]) for k in range(3))
    return ConsistencyFlight(draw, nees, (errors**2).mean(axis=0), variances.mean(axis=0), squares, scalars)


def _look(vehicle: Simulation) -> tuple[list[float], Array, Array]:
    """NEES of what is ``JUDGED``, and errors of the first nine with what was said of them."""
    truth, air = vehicle.truth, vehicle.wind
    vehicle.advance(vehicle.avionics.horizon_periods)
    e = errors_of(vehicle, truth, air)
    P = np.array(vehicle.avionics.filter.covariance)
    squares = [float(e[part] @ np.linalg.solve(P[part, part], e[part])) for part in JUDGED]
    return squares, e[:9], np.diag(P)[:9]


def errors_of(vehicle: Simulation, truth: Plant, air: Vector) -> Array:
    """Errors of the filter, (18,): of position, velocity, attitude, both inertial biases and wind.

    Axes that lie askew read gravity as a bias of the accelerometer, which turns with the vehicle. What they make of
    rates and accelerations passes; what it leaves behind is an error of attitude and velocity.

    Args:
        vehicle: Whose filter stands where the truth was taken.
        truth: The plant there.
        air: Velocity of the air there, world NWU [m/s].
    """
    b = copy_of(vehicle.avionics.filter.nominal)
    hidden = copy_of(vehicle.avionics.instruments.errors)
    weight = rotate_inverse(truth.body.attitude, Vector(0.0, 0.0, vehicle.airframe.g))
    askew = cross(weight, hidden.imu_misalignment)
    off = multiply(conjugate(b.attitude), truth.body.attitude)
    twice = 2.0 if off.w >= 0.0 else -2.0
    parts = (
        subtract(truth.body.position, b.position),
        subtract(truth.body.velocity, b.velocity),
        (twice * off.x, twice * off.y, twice * off.z),
        subtract(add(hidden.gyro_bias, hidden.gyro_drift), b.gyro_bias),
        subtract(add(add(hidden.accel_bias, hidden.accel_drift), askew), b.accel_bias),
        subtract(air, b.wind),
    )
    return np.concatenate([np.array(part) for part in parts])


def run(
    seeds: Sequence[int],
    craft: Craft,
    jobs: int = 2,
    on_progress: Callable[[int], None] = ignore_progress,
    gusts: float = GUSTS,
) -> list[ConsistencyFlight]:
    """Fly every phase with a right and a wrong model by all seeds; order and results do not depend on the jobs."""
    draws = [ConsistencyDraw(seed, phase, wrong, gusts) for wrong in (False, True) for phase in Phase for seed in seeds]
    return fly_draws(partial(fly, craft=craft), draws, jobs, on_progress=on_progress)


class ConsistencyVerdict(NamedTuple):
    """The NEES of one of the ``JUDGED`` in the flights of one phase together."""

    mean: float
    low: float  # 95 % bounds of the mean over the flights at one look
    high: float
    inside: float  # share of the looks whose mean lies between them


class InnovationVerdict(NamedTuple):
    """The innovations of one instrument in the flights of one phase together."""

    name: str
    mean: float  # squared innovation over its variance
    low: float  # 95 % bounds of the mean over the flights between two looks
    high: float
    inside: float  # share of the looks whose mean lies between them


def verdict(flights: Sequence[ConsistencyFlight], part: slice = ALL_ERRORS) -> ConsistencyVerdict:
    """Judge one of the ``JUDGED`` in flights of one phase."""
    n, N = part.stop - part.start, len(flights)
    low, high = (float(chdtri(n * N, p) / N) for p in (0.975, 0.025))
    means = np.mean([flight.nees[:, JUDGED.index(part)] for flight in flights], axis=0)
    inside = float(np.mean((means >= low) & (means <= high)))
    return ConsistencyVerdict(float(means.mean()), low, high, inside)


def judged_innovations(flights: Sequence[ConsistencyFlight]) -> list[InnovationVerdict]:
    """Judge the innovations of every instrument that read in flights of one phase."""
    squares = np.sum([flight.squares for flight in flights], axis=0)
    scalars = np.sum([flight.scalars for flight in flights], axis=0)
    verdicts = []
    for line, name in enumerate(LINE_NAMES):
        read = scalars[:, line] > 0.0
        if read.any():
            count = scalars[read, line]
            means = squares[read, line] / count
            low, high = (chdtri(count, p) / count for p in (0.975, 0.025))
            inside = float(np.mean((means >= low) & (means <= high)))
            whole = float(squares[:, line].sum() / scalars[:, line].sum())
            verdicts.append(InnovationVerdict(name, whole, float(low.min()), float(high.max()), inside))
    return verdicts


def summary(flown: Sequence[ConsistencyFlight]) -> list[str]:
    """NEES, NIS and errors by phase and model, as lines of text."""
    lines = []
    for wrong in (False, True):
        lines.append(f"model {'10 % wrong' if wrong else 'right'}, {ALL_ERRORS.stop} errors")
        for phase in Phase:
            own = [flight for flight in flown if flight.draw.phase is phase and flight.draw.wrong is wrong]
            if own:
                lines += _phase_lines(phase, own)
    return lines


def _phase_lines(phase: Phase, own: Sequence[ConsistencyFlight]) -> list[str]:
    v, navigation, wind = (verdict(own, part) for part in JUDGED)
    rms = np.sqrt(np.mean([flight.squared for flight in own], axis=0))
    said = np.sqrt(np.mean([flight.said for flight in own], axis=0))
    read = [f"{i.name} {i.mean:.2f} ({i.low:.2f} to {i.high:.2f})" for i in judged_innovations(own)]
    scaled = [np.linalg.norm(part[k : k + 3]) for part in (rms, said) for k in (0, 3, 6)]
    bounds = f"95 % bounds {v.low:.2f} to {v.high:.2f}, {100 * v.inside:.0f} % of looks inside"
    without, air = (f"{part.mean:.2f} ({part.low:.2f} to {part.high:.2f})" for part in (navigation, wind))
    place, speed, turn = (f"{scaled[k]:.3f} (said {scaled[k + 3]:.3f})" for k in range(3))
    return [
        f"  {phase.value:<12} NEES {v.mean:.2f} ({bounds})",
        f"  {'':<12} NEES of the {NAVIGATION.stop} without the wind {without}, of the wind {air}",
        f"  {'':<12} error {place} m, {speed} m/s, {turn} rad",
        f"  {'':<12} NIS: {', '.join(read)}",
    ]


def study_consistency(args: argparse.Namespace) -> int:
    """Fly and print NEES and NIS; exit code 1 if the filter is surer than it may be."""
    check_seeded(args, {"gusts": 10.0})

    craft = craft_of(args)
    if craft.navigation.value == "truth":
        raise SitlError("--nav truth: there is no filter to judge")
    of = 6 * args.flights
    flown = run(
        range(args.first, args.first + args.flights),
        craft,
        args.jobs,
        lambda done: print_progress(done, of),
        args.gusts,
    )
    print("\n".join(summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [{"draw": str(flight.draw), "nees": flight.nees[:, 0].tolist()} for flight in flown])
    groups = [
        [flight for flight in flown if flight.draw.phase is phase and flight.draw.wrong is wrong]
        for phase in Phase
        for wrong in (False, True)
    ]
    verdicts = [verdict(group, part) for group in groups for part in JUDGED]
    return 0 if all(v.mean <= v.high for v in verdicts) else 1
