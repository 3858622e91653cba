"""Whether the navigation filter is as wrong as it says: NEES and NIS over many seeds.

The *normalised estimation error squared* of n errors is chi-squared with n degrees of freedom if the covariance is
right; its mean over N flights then lies within the chi-squared bounds of n N degrees, divided by N (Bar-Shalom, Li
and Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 5.4). Every look is judged by itself: of the
means at 95 % bounds 95 % lie inside, less what chance takes of so many looks. Errors are judged where the filter
stands, at its horizon.

The wing is no instrument: what an unknown wind makes of its force lasts, so its innovations go together, and the filter
allows for a model that lacks. It is judged against being too sure alone. So is a wrong model, by a mean NEES.
"""

from __future__ import annotations

import argparse
import enum
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.special import bdtr, chdtri

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
SHARE_INSIDE, BY_CHANCE = 0.95, 0.025  # of the looks, and probability of so few of them
MAX_WRONG = 4.0  # mean NEES per error of a filter whose model is wrong: its errors are twice as large as it says
MODEL_ERROR = 0.1  # how far a wrong model's constants are off, either way by turns
# What is judged: all errors (position, velocity, attitude, both inertial biases, wind), without the wind, and the wind.
ALL_ERRORS, NAVIGATION, WIND = slice(0, WIND_ERROR + 3), slice(0, WIND_ERROR), slice(WIND_ERROR, WIND_ERROR + 3)
JUDGED = (ALL_ERRORS, NAVIGATION, WIND)
PART_NAMES = (f"all {ALL_ERRORS.stop}", f"the {NAVIGATION.stop} without the wind", "the wind")
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
    level: float  # of the gusts, as the filter believes it, mean of the looks [m/s]


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
    looks, counted, levels = [], [], []
    while vehicle.time < SECONDS:
        if draw.phase is Phase.TRANSITION and vehicle.time >= STOP_AFTER and vehicle.reference.forward:
            vehicle.reference = hover_at((STOP_AT, 0.0, JUDGED_HEIGHT), 0.0)
        if vehicle.time >= FIRST_LOOK:
            looks.append(_look(vehicle))
            f = vehicle.avionics.filter
            counted.append((np.array(f.squares), np.array(f.scalars)))
            levels.append(float(f.gusts.level))
        vehicle.advance(EVERY_PERIODS - vehicle.periods % EVERY_PERIODS)
    squares, scalars = (np.diff([count[k] for count in counted], axis=0) for k in (0, 1))
    nees, errors, variances = (np.array([look[k] for look in looks]) for k in range(3))
    said, level = variances.mean(axis=0), float(np.mean(levels))
    return ConsistencyFlight(draw, nees, (errors**2).mean(axis=0), said, squares, scalars, level)


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


class Shares(NamedTuple):
    """Looks whose mean over the flights lies inside its 95 % bounds, below and above, as shares."""

    inside: float
    below: float  # the filter is too cautious
    above: float  # the filter is too sure
    least: float  # of the looks inside that chance allows

    @property
    def hold(self) -> bool:
        """Whether the filter is neither too sure nor too cautious."""
        return self.inside >= self.least

    @property
    def are_not_too_sure(self) -> bool:
        """Whether it is at most too cautious."""
        return 1.0 - self.above >= self.least


def shares_of(means: Array, low: Array | float, high: Array | float) -> Shares:
    """Judge means of looks by their bounds, (k,) each."""
    below, above = float(np.mean(means < low)), float(np.mean(means > high))
    return Shares(1.0 - below - above, below, above, least_inside(len(means)))


def least_inside(looks: int) -> float:
    """Share of the looks that lie inside 95 % bounds at least, but for one case in forty."""
    outside = next(k for k in range(looks + 1) if bdtr(k, looks, 1.0 - SHARE_INSIDE) >= 1.0 - BY_CHANCE)
    return 1.0 - outside / looks


class ConsistencyVerdict(NamedTuple):
    """The NEES of one of the ``JUDGED`` in the flights of one phase together."""

    mean: float
    low: float  # 95 % bounds of the mean over the flights at one look
    high: float
    errors: int
    shares: Shares


class InnovationVerdict(NamedTuple):
    """The innovations of one instrument in the flights of one phase together."""

    name: str
    mean: float  # squared innovation over its variance
    low: float  # 95 % bounds of the mean over the flights between two looks
    high: float
    shares: Shares

    @property
    def holds(self) -> bool:
        """Whether they are as large as the filter says; of the wing, whether they are no larger."""
        return self.shares.are_not_too_sure if self.name == LINE_NAMES[-1] else self.shares.hold


def verdict(flights: Sequence[ConsistencyFlight], part: slice = ALL_ERRORS) -> ConsistencyVerdict:
    """Judge one of the ``JUDGED`` in flights of one phase."""
    n, N = part.stop - part.start, len(flights)
    low, high = (float(chdtri(n * N, p) / N) for p in (0.975, 0.025))
    means = np.mean([flight.nees[:, JUDGED.index(part)] for flight in flights], axis=0)
    return ConsistencyVerdict(float(means.mean()), low, high, n, shares_of(means, low, high))


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
            whole = float(squares[:, line].sum() / scalars[:, line].sum())
            verdicts.append(
                InnovationVerdict(name, whole, float(low.min()), float(high.max()), shares_of(means, low, high))
            )
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
    rms = np.sqrt(np.mean([flight.squared for flight in own], axis=0))
    said = np.sqrt(np.mean([flight.said for flight in own], axis=0))
    innovations = judged_innovations(own)
    read = [f"{i.name} {i.mean:.2f} ({100 * i.shares.inside:.0f} %)" for i in innovations]
    scaled = [np.linalg.norm(part[k : k + 3]) for part in (rms, said) for k in (0, 3, 6)]
    place, speed, turn = (f"{scaled[k]:.3f} (said {scaled[k + 3]:.3f})" for k in range(3))
    level = float(np.mean([flight.level for flight in own]))
    return [
        *(
            f"  {phase.value if k == 0 else '':<12} NEES of {name} {v.mean:.2f} ({v.low:.2f} to {v.high:.2f}; "
            f"looks inside {_looks(v.shares)})"
            for k, (name, v) in enumerate(zip(PART_NAMES, (verdict(own, part) for part in JUDGED), strict=True))
        ),
        f"  {'':<12} error {place} m, {speed} m/s, {turn} rad; gusts believed {level:.2f} m/s",
        f"  {'':<12} NIS (looks inside): {', '.join(read)}",
    ]


def _looks(shares: Shares) -> str:
    outside = [f"{100 * share:.0f} % {side}" for side, share in (("below", shares.below), ("above", shares.above))]
    return f"{100 * shares.inside:.0f} %, {', '.join(outside)}"


def faults(flown: Sequence[ConsistencyFlight]) -> list[str]:
    """Findings that are not as wrong as the filter says, as lines of text; none if all is.

    With the right model every look is judged on both sides; with a wrong one only the mean, against being too sure.
    """
    found = []
    for phase in Phase:
        own = [[f for f in flown if f.draw.phase is phase and f.draw.wrong is wrong] for wrong in (False, True)]
        for name, part in zip(PART_NAMES, JUDGED, strict=True):
            right, wrong = (verdict(flights, part) for flights in own)
            if not right.shares.hold:
                found.append(f"{phase.value}: NEES of {name}, looks inside {_looks(right.shares)}")
            if wrong.mean > MAX_WRONG * wrong.errors:
                found.append(f"{phase.value}, wrong model: NEES of {name} {wrong.mean:.2f}")
        failing = [told for told in judged_innovations(own[0]) if not told.holds]
        found += [f"{phase.value}: NIS of {told.name}, looks inside {_looks(told.shares)}" for told in failing]
    return found


def study_consistency(args: argparse.Namespace) -> int:
    """Fly and print NEES and NIS; exit code 1 if the filter is surer or more cautious than it may be."""
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
    found = faults(flown)
    least = 100 * least_inside(len(flown[0].nees))
    print(
        "\n".join(
            [f"outside (at least {least:.0f} % of the looks have to be inside):", *found] if found else ["all hold"]
        )
    )
    return 1 if found else 0
