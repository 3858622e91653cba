"""Legs of the table as they are flown every day: on sensors, in gusts, with a wrong model, beside the bound."""

from __future__ import annotations

import argparse
import math
import statistics
import sys
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from protocol.dialect.vocabulary import LegMode
from protocol.ranges import MAX_AIRSPEED
from sitl import PERIOD, Array, DivergedError, SitlError
from sitl.lab.optimal.bound import Bound
from sitl.lab.optimal.flown_leg import WayToFly, leg_end, leg_start, set_out, until_there, ways_to_fly
from sitl.lab.optimal.question import CRUISE_END, Question
from sitl.lab.optimal.yardstick import LEFT, ROW_NAMES, row_question, shown_bound
from sitl.lab.studies.proportions import counted
from sitl.lab.studies.seeded_flights import (
    SAMPLE_PERIODS,
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    print_progress,
    write_json,
)
from sitl.lab.studies.wrong_models import drawn_scale, perturbed

HELD = 10.0  # after the arrival [s]; the end is judged over its second half
NEAR_ENERGY, NEAR_TIME, NEAR_END = 1.2, 1.4, 0.5  # over the bound's, in the median; from the end, likewise [m]
WAY_OPTIONS = {"chosen": LegMode.NONE, "upright": LegMode.HOVER, "forward": LegMode.FORWARD}
STREAM = 38  # of random numbers, beside those of other studies


class LegDraw(NamedTuple):
    """Conditions of one flight."""

    row: str
    seed: int
    gusts: float  # rms per axis [m/s]
    parameters: float  # greatest relative error of the design model
    way: WayToFly


class SeededLeg(NamedTuple):
    """Result of one flight; lengths in metres."""

    row: str
    seed: int
    time: float  # until it arrived [s]; infinite: never
    energy: float  # until then [J]
    end: float  # mean distance from the end, afterwards; in a cruise as it is passed
    beyond: float  # the end, along the leg, farthest
    below: float  # the lower of its ends
    above: float  # the higher one
    fault: str  # a crash, in words; empty: none


def fly_seeded(draw: LegDraw, craft: Craft) -> SeededLeg:
    """Fly one."""
    question = row_question(draw.row, craft.airframe)
    random = np.random.default_rng((draw.seed, STREAM))
    scale = drawn_scale(random, draw.parameters)
    model = craft.model
    vehicle = craft._replace(pace=draw.way.pace).fly(draw.seed, leg_start(question), perturbed(model, scale))
    way = draw.way
    if CRUISE_END in {question.start, question.end}:
        way = ways_to_fly(question, briskly=False)[0]._replace(pace=way.pace)
    aircraft = set_out(question, vehicle, way, draw.gusts)
    flown = until_there(aircraft, question, craft.controller, way)
    rest: list[tuple[float, ...]] = []
    fault = "" if vehicle.crash is None else f"crashed after {flown.times[-1]:.1f} s"
    try:
        while question.end != CRUISE_END and not fault and len(rest) < HELD / (SAMPLE_PERIODS * PERIOD):
            aircraft.advance(SAMPLE_PERIODS)
            rest.append(aircraft.vehicle.truth.body.position)
            fault = "" if vehicle.crash is None else "crashed at the end"
    except DivergedError as error:
        fault = str(error).split(":")[0]
    return _judged(draw, question, np.array([*flown.plant[:, :3], *rest]), (flown.time, flown.energy), fault)


def _judged(draw: LegDraw, question: Question, p: Array, cost: tuple[float, float], fault: str) -> SeededLeg:
    end, up = leg_end(question), question.place[2]
    last = 1 if question.end == CRUISE_END else round(0.5 * HELD / (SAMPLE_PERIODS * PERIOD))
    return SeededLeg(
        row=draw.row,
        seed=draw.seed,
        time=cost[0],
        energy=cost[1],
        end=math.inf if fault else float(np.linalg.norm(p[-last:] - end, axis=1).mean()),
        beyond=float(p[:, 0].max() - end[0]),
        below=float(min(up, end[2]) - p[:, 2].min()),
        above=float(p[:, 2].max() - max(up, end[2])),
        fault=fault,
    )


class RowBounds(NamedTuple):
    """Least time and least energy of a row with the share left; NaN: no bound."""

    time: float  # [s]
    energy: float  # [J]
    agree: bool = True  # guesses and meshes within 1 %; else it is the best course found


def row_bounds(name: str, airframe: str) -> RowBounds:
    """Bounds of a row."""
    question = row_question(name, airframe)._replace(share_left=LEFT)
    quick, cheap = (_found(question._replace(time_price=price)) for price in (math.inf, 0.0))
    return RowBounds(
        time=quick.time if quick else math.nan,
        energy=cheap.energy if cheap else math.nan,
        agree=all(bound is not None and bound.agrees for bound in (quick, cheap)),
    )


def _found(question: Question) -> Bound | None:
    try:
        return shown_bound(question)
    except SitlError as error:
        print(error, file=sys.stderr)
        return None


def summary(legs: Sequence[SeededLeg], bounds: dict[str, RowBounds]) -> list[str]:
    """The flights by row beside the bounds, as lines of text."""
    lines = [
        f"{'leg':<12}{'flown':>6}{'lost':>5}{'time [s]':>10}{'/bound':>8}{'energy [J]':>12}{'/bound':>8}"
        f"{'end':>7}{'beyond':>8}{'below':>7}{'above':>7}",
        f"{'':<17}{'':>6}{'median':>10}{'':>8}{'median':>12}{'':>8}{'worst [m]':>29}",
    ]
    for row in dict.fromkeys(leg.row for leg in legs):
        own = [leg for leg in legs if leg.row == row]
        time, energy = (statistics.median(getattr(leg, name) for leg in own) for name in ("time", "energy"))
        worst = [max(getattr(leg, name) for leg in own) for name in ("end", "beyond", "below", "above")]
        bound = bounds[row]
        name = row if bound.agree else f"{row}*"
        lines.append(
            f"{name:<12}{len(own):>6}{sum(bool(leg.fault) for leg in own):>5}{time:>10.2f}{time / bound.time:>8.2f}"
            f"{energy:>12.0f}{energy / bound.energy:>8.2f}{worst[0]:>7.2f}{worst[1]:>8.2f}"
            f"{worst[2]:>7.2f}{worst[3]:>7.2f}"
        )
    there = sum(not leg.fault and leg.end <= NEAR_END for leg in legs)
    lines.append(f"not lost: {counted(sum(not leg.fault for leg in legs), len(legs))}")
    lines.append(f"held within {NEAR_END:g} m of the end: {counted(there, len(legs))}")
    time, energy = ratios(legs, bounds)
    lines.append(f"over the bound, median of the rows: time {time:.2f}, energy {energy:.2f}")
    if not all(bound.agree for bound in bounds.values()):
        lines.append("* the best course found; guesses or meshes do not agree within 1 %")
    return lines + [f"{leg.row}, seed {leg.seed}: {leg.fault}" for leg in legs if leg.fault]


def ratios(legs: Sequence[SeededLeg], bounds: dict[str, RowBounds]) -> tuple[float, float]:
    """Time and energy over the bounds, medians of each row's medians; NaN without one.

    A row counts that has a bound and that half of the flights do.
    """
    found: tuple[list[float], list[float]] = [], []
    for row, bound in bounds.items():
        own = [leg for leg in legs if leg.row == row]
        for each, name in zip(found, ("time", "energy"), strict=True):
            ratio = statistics.median(getattr(leg, name) for leg in own) / getattr(bound, name)
            each.extend([ratio] if math.isfinite(ratio) else [])
    return statistics.median(found[0] or [math.nan]), statistics.median(found[1] or [math.nan])


def fly_rows(args: argparse.Namespace) -> int:
    """Fly the rows and print them beside their bounds; exit code 1: one is lost or off, or they are far from it."""
    check_seeded(args, {"gusts": 10.0, "parameters": 0.5, "airspeed": MAX_AIRSPEED})
    rows = args.rows or ROW_NAMES
    for name in rows:
        row_question(name, args.airframe).check()
    bounds = {name: RowBounds(math.nan, math.nan) for name in rows}
    if not args.flights_only:
        bounds = {name: row_bounds(name, args.airframe) for name in rows}
    way = WayToFly(WAY_OPTIONS[args.way], args.airspeed, args.pace)
    draws = [
        LegDraw(row, seed, args.gusts, args.parameters, way)
        for row in rows
        for seed in range(args.first, args.first + args.flights)
    ]
    flown = fly_draws(
        partial(fly_seeded, craft=craft_of(args)),
        draws,
        args.jobs,
        on_progress=lambda done: print_progress(done, len(draws)),
    )
    print("\n".join(summary(flown, bounds)), flush=True)
    if args.json is not None:
        write_json(args.json, [leg._asdict() for leg in flown])
    time, energy = ratios(flown, bounds)
    near = args.flights_only or (time <= NEAR_TIME and energy <= NEAR_ENERGY)
    return 0 if near and all(not leg.fault and leg.end <= NEAR_END for leg in flown) else 1
