"""Liveness of the table of jumps: from every law, in steady winds, every kind of goal is reached or handed over.

A law whose exit never comes true holds the vehicle short of its goal for ever, without a fault that anything else would
notice. So each law is put in force and each goal asked for, in steady winds from any side and with a wrong model.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from typing import NamedTuple

import numpy as np

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.plans.plan import MissionItem
from sitl import TABLE, Aircraft, Configuration, DivergedError, Law, Regime, Settings, Start, WorldSettings
from sitl.lab.studies.proportions import counted
from sitl.lab.studies.seeded_flights import (
    DEFAULT_CRAFT,
    SAMPLE_PERIODS,
    STUDY_WORLD,
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    has_finished_mission,
    ignore_progress,
    print_progress,
    seeds,
    waypoint,
    write_json,
)
from sitl.lab.studies.wrong_models import drawn_scale, perturbed

LIVE_HEIGHT = 30.0  # [m]
NEAR_AWAY, FAR_AWAY = 8.0, 100.0  # goals that are hovered to, and flown to [m]
HELD_TIME = 2.0  # at the end of what is held [s]
LIVE_TIME = 150.0  # whoever takes longer is stuck: twice what the slowest, a landing, took [s]
FLYING_LAWS = tuple(law for law in TABLE if law.regime is not Regime.GROUND)


class LiveGoal(StrEnum):
    """Kind of goal."""

    HOLD = "hold"
    HOVER = "hover"
    STOP = "stop"
    CORNER = "corner"
    LAND = "land"


class LiveDraw(NamedTuple):
    """One flight to be flown."""

    law: Law  # in force when the goal is asked for
    goal: LiveGoal
    wind: float  # steady [m/s]; its side is drawn
    parameters: float  # greatest relative error of the design model
    seed: int


class LiveFlight(NamedTuple):
    """Result of one flight."""

    draw: LiveDraw
    time: float  # until the goal, or until it was given up [s]
    last: str  # law in force at the end
    fault: str  # empty if the goal was reached


def goal_items(goal: LiveGoal) -> list[MissionItem]:
    """The mission of a goal, from above the origin."""
    if goal is LiveGoal.HOLD:
        return [waypoint(0.0, 0.0, LIVE_HEIGHT, HELD_TIME)]
    if goal is LiveGoal.HOVER:
        return [waypoint(NEAR_AWAY, 0.0, LIVE_HEIGHT, HELD_TIME)]
    if goal is LiveGoal.LAND:
        return [replace(waypoint(NEAR_AWAY, 0.0, 0.0), command=mavlink.MAV_CMD_NAV_LAND)]
    end = [waypoint(FAR_AWAY, 0.0, LIVE_HEIGHT, HELD_TIME if goal is LiveGoal.STOP else 0.0)]
    return end if goal is LiveGoal.STOP else [*end, waypoint(FAR_AWAY, FAR_AWAY, LIVE_HEIGHT, HELD_TIME)]


def fly_to_goal(draw: LiveDraw, craft: Craft = DEFAULT_CRAFT) -> LiveFlight:
    """Fly one draw."""
    random = np.random.default_rng((draw.seed, int(draw.law), list(LiveGoal).index(draw.goal), round(10 * draw.wind)))
    heading, wind_from = random.uniform(-math.pi, math.pi, 2)
    scale = drawn_scale(random, draw.parameters)
    start = Start(up=LIVE_HEIGHT, heading=float(heading), airborne=True)
    vehicle = craft.fly(draw.seed, start, perturbed(craft.model, scale))
    air = WorldSettings(draw.wind, math.degrees(wind_from), 0.0, battery=1e6)
    flies = draw.goal in {LiveGoal.STOP, LiveGoal.CORNER}
    settings = Settings(leg_mode=int(LegMode.FORWARD if flies else LegMode.HOVER))
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(settings, vehicle.tuning, air), airborne=True)
    aircraft.autopilot.missions.load(goal_items(draw.goal))
    aircraft.autopilot.missions.start()
    vehicle.enter(draw.law)
    fault = _flown(aircraft)
    return LiveFlight(draw, vehicle.time, vehicle.law.name, fault)


def _flown(aircraft: Aircraft) -> str:
    """Fly until the goal is reached; gives what went wrong."""
    vehicle = aircraft.vehicle
    try:
        while not has_finished_mission(aircraft) and vehicle.time < LIVE_TIME and vehicle.crash is None:
            aircraft.advance(SAMPLE_PERIODS)
    except DivergedError as error:
        return str(error).split(":")[0]
    if vehicle.crash is not None:
        return f"crashed at {vehicle.crash.speed:.1f} m/s"
    if has_finished_mission(aircraft):
        return ""
    off = math.dist(vehicle.truth.body.position, vehicle.reference.position)
    return f"{off:.1f} m from its goal after {LIVE_TIME:.0f} s, V {vehicle.v_hover:.0f}"


def live_draws(numbers: Sequence[int], winds: Sequence[float], parameters: float) -> list[LiveDraw]:
    """Every law with every goal in every wind, by every seed."""
    return [
        LiveDraw(law, goal, wind, parameters, seed)
        for law, goal, wind, seed in itertools.product(FLYING_LAWS, LiveGoal, winds, numbers)
    ]


def run_live(
    draws: Sequence[LiveDraw],
    craft: Craft = DEFAULT_CRAFT,
    jobs: int = 2,
    on_progress: Callable[[int], None] = ignore_progress,
) -> list[LiveFlight]:
    """Fly them; their order and results do not depend on the jobs.

    Raises:
        SitlError: There is nothing to fly.
    """
    return fly_draws(partial(fly_to_goal, craft=craft), draws, jobs, at_once=4, on_progress=on_progress)


def summary(flown: Sequence[LiveFlight]) -> list[str]:
    """A row for each law: how many reached each goal, and the longest time; below it, each that did not."""
    lines = [f"{'begun in':<24}" + "".join(f"{goal:>16}" for goal in LiveGoal)]
    for law in dict.fromkeys(f.draw.law for f in flown):
        groups = ([f for f in flown if (f.draw.law, f.draw.goal) == (law, goal)] for goal in LiveGoal)
        lines.append(f"{law.name:<24}" + "".join(f"{_cell(group):>16}" for group in groups))
    reached = sum(not f.fault for f in flown)
    lines += ["", f"{counted(reached, len(flown))} reach their goal"]
    return lines + [
        f"stuck: begun in {f.draw.law.name}, {f.draw.goal}, {f.draw.wind:g} m/s, seed {f.draw.seed}: "
        f"in {f.last}, {f.fault}"
        for f in flown
        if f.fault
    ]


def _cell(group: Sequence[LiveFlight]) -> str:
    if not group:
        return "-"
    return f"{sum(not f.fault for f in group)}/{len(group)}, {max(f.time for f in group):.0f} s"


def study_liveness(args: argparse.Namespace) -> int:
    """Fly them and print who is stuck; exit code 1 if one is."""
    check_seeded(args, {"wind": 15.0, "parameters": 0.3})
    draws = live_draws(seeds(args.flights, args.first), args.wind, args.parameters)
    flown = run_live(draws, craft_of(args), args.jobs, lambda done: print_progress(done, len(draws)))
    print("\n".join(summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [f._asdict() | {"draw": f.draw._asdict() | {"law": f.draw.law.name}} for f in flown])
    return 1 if any(f.fault for f in flown) else 0
