"""Holding a point in wind and gusts through the whole autopilot, many seeds: how far off, and how often."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from sitl import Aircraft, Airframe, Configuration, DivergedError, Settings, Start, WorldSettings
from sitl.lab.studies.seeded_flights import (
    DEFAULT_CRAFT,
    SAMPLE_PERIODS,
    STUDY_WORLD,
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    ignore_progress,
    print_progress,
    write_json,
)
from sitl.lab.studies.wrong_models import drawn_scale, perturbed

HOLD_HEIGHT = 30.0  # [m]
LEAD_IN, HOLD_TIME = 20.0, 60.0  # [s]
TIME_SHARE = 0.95  # of the time within a distance that counts
LOOK_TIME = 0.02  # [s]
MODERATE_WIND, MODERATE_ACROSS, MODERATE_ABOVE = 5.0, 1.0, 0.7  # [m/s]; it shall keep so near in no more wind [m], [m]
STRONG_WIND, STRONG_ACROSS = 8.0, 3.0  # [m/s], [m]


class FlownHold(NamedTuple):
    """Result of one hold."""

    seed: int
    wind: float  # [m/s]
    across: float  # horizontal distance not exceeded for TIME_SHARE of the time [m]
    above: float  # vertical distance likewise [m]
    farthest: float  # horizontally [m]
    highest: float  # vertical distance, greatest [m]
    near: float  # share of the time within the distances that its wind allows
    laws: int  # that flew it
    fault: str  # why it ended; empty if it did not


class HoldConditions(NamedTuple):
    """Conditions of one hold."""

    seed: int
    wind: float  # steady [m/s]; its direction is drawn
    gusts: float  # rms per axis [m/s]
    parameters: float  # greatest relative error of the design model


def fly_hold(conditions: HoldConditions, craft: Craft = DEFAULT_CRAFT) -> FlownHold:
    """Fly one hold."""
    random = np.random.default_rng(conditions.seed)
    wind_from = math.degrees(float(random.uniform(0.0, math.tau)))
    airframe = _drawn(craft.model, conditions, random)
    vehicle = craft.fly(conditions.seed, Start(up=HOLD_HEIGHT, airborne=True), airframe)
    air = WorldSettings(conditions.wind, wind_from, conditions.gusts, battery=1e6)
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(Settings(), vehicle.tuning, air), airborne=True)
    positions, laws, fault = [], set(), ""
    try:
        for look in range(round((LEAD_IN + HOLD_TIME) / LOOK_TIME)):
            aircraft.advance(SAMPLE_PERIODS)
            if look * LOOK_TIME >= LEAD_IN:
                positions.append(vehicle.truth.body.position)
                laws.add(vehicle.law)
    except DivergedError as error:
        fault = str(error).split(":")[0]
    if not positions:
        return FlownHold(conditions.seed, conditions.wind, *(math.inf,) * 4, 0.0, len(laws), fault)
    p = np.array(positions)
    across, above = np.hypot(p[:, 0], p[:, 1]), np.abs(p[:, 2] - HOLD_HEIGHT)
    most_across, most_above = allowed(conditions.wind)
    return FlownHold(
        seed=conditions.seed,
        wind=conditions.wind,
        across=float(np.quantile(across, TIME_SHARE)),
        above=float(np.quantile(above, TIME_SHARE)),
        farthest=float(across.max()),
        highest=float(above.max()),
        near=float(np.mean((across <= most_across) & (above <= most_above))),
        laws=len(laws),
        fault=fault,
    )


def allowed(wind: float) -> tuple[float, float]:
    """Greatest distance allowed from the set-point in a wind [m/s], horizontally and vertically [m]."""
    if wind <= MODERATE_WIND:
        return MODERATE_ACROSS, MODERATE_ABOVE
    return (STRONG_ACROSS if wind <= STRONG_WIND else math.inf), math.inf


def _drawn(model: Airframe, conditions: HoldConditions, random: np.random.Generator) -> Airframe:
    return perturbed(model, drawn_scale(random, conditions.parameters))


def run_holds(
    conditions: Sequence[HoldConditions],
    craft: Craft = DEFAULT_CRAFT,
    jobs: int = 2,
    on_progress: Callable[[int], None] = ignore_progress,
) -> list[FlownHold]:
    """Fly holds; their order and results do not depend on the jobs.

    Raises:
        SitlError: There is nothing to fly.
    """
    return fly_draws(partial(fly_hold, craft=craft), conditions, jobs, on_progress=on_progress)


def summary(holds: Sequence[FlownHold]) -> list[str]:
    """The holds by wind, as lines of text."""
    lines = [
        f"{'wind':>6}{'holds':>7}{'within 95 % of the time':>28}{'vertically':>20}{'farthest':>12}{'higher':>9}"
        f"{'near':>9}"
    ]
    lines += [f"{'m/s':>6}{'':>7}{'median / greatest [m]':>28}{'[m]':>20}{'[m]':>12}{'[m]':>9}{'of time':>9}"]
    for wind in sorted({hold.wind for hold in holds}):
        group = [hold for hold in holds if hold.wind == wind]
        across, above = [hold.across for hold in group], [hold.above for hold in group]
        lines.append(
            f"{wind:>6g}{len(group):>7}{f'{np.median(across):.2f} / {max(across):.2f}':>28}"
            f"{f'{np.median(above):.2f} / {max(above):.2f}':>20}"
            f"{max(hold.farthest for hold in group):>12.2f}{max(hold.highest for hold in group):>9.2f}"
            f"{f'{100 * np.mean([hold.near for hold in group]):.1f} %':>9}"
        )
    lines += [f"ended: seed {hold.seed} in {hold.wind:g} m/s: {hold.fault}" for hold in holds if hold.fault]
    return lines


MIN_NEAR = 0.95  # of the time of all holds in a wind


def study_holds(args: argparse.Namespace) -> int:
    """Fly the holds and print how far off they were; exit code 1 if one is farther off than it may be."""
    check_seeded(args, {"wind": 30.0, "gusts": 10.0, "parameters": 0.5})

    seeds = range(args.first, args.first + args.flights)
    conditions = [HoldConditions(s, wind, args.gusts, args.parameters) for wind in args.wind for s in seeds]
    flown = run_holds(
        conditions, craft_of(args), args.jobs, on_progress=lambda done: print_progress(done, len(conditions))
    )
    print("\n".join(summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [hold._asdict() for hold in flown])
    return 0 if passed(flown) else 1


def passed(flown: Sequence[FlownHold]) -> bool:
    """Whether no hold ended, and those of each wind were near for most of the time."""
    winds = {hold.wind for hold in flown}
    shares = [[hold.near for hold in flown if hold.wind == wind] for wind in winds]
    return not any(hold.fault for hold in flown) and all(sum(near) >= MIN_NEAR * len(near) for near in shares)
