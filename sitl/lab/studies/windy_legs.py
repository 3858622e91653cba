"""Legs in strong wind through the whole autopilot, many seeds: hold, fly a leg, hold again, with a wrong model."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.plans.plan import MissionItem
from sitl import Aircraft, Array, Configuration, DivergedError, Regime, Settings, Start, WorldSettings
from sitl.lab.studies.proportions import counted
from sitl.lab.studies.seeded_flights import (
    SAMPLE_PERIODS,
    STUDY_WORLD,
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    has_finished_mission,
    print_progress,
    waypoint,
    write_json,
)
from sitl.lab.studies.wrong_models import drawn_scale, perturbed

WINDY_LENGTH, WINDY_AIRSPEED, WINDY_HEIGHT = 150.0, 15.0, 60.0  # [m], [m/s], [m]
HOLD_FIRST, HOLD_LAST = 15.0, 25.0  # [s]
LAST_SECONDS = 10.0  # of the last hold, at its end [s]
WINDY_TIME = 200.0  # [s]
REACHED = 10.0  # farther from the end of the leg than this in the end, it is not done [m]
ALLOWED_BEYOND, ALLOWED_ABOVE = 3.0, 10.0  # of the leg [m]
CONTROL_RATE = 500.0  # [1/s]


class WindySide(NamedTuple):
    """Direction that the wind comes from, seen along the leg."""

    name: str
    azimuth: float  # clockwise from the leg [rad]


WIND_SIDES = (WindySide("head", 0.0), WindySide("tail", math.pi), WindySide("cross", 0.5 * math.pi))


class WindyLeg(NamedTuple):
    """Result of one flight."""

    seed: int
    wind: float  # [m/s]
    side: str
    done: bool
    crashed: bool
    error: float  # mean distance from the end of the leg at the end of the last hold [m]
    beyond: float  # the end of the leg, along it, farthest [m]
    above: float  # the leg [m]
    aside: float  # of it [m]
    energy: float  # from the start of the leg until its end is reached [J]
    time: float  # likewise [s]
    jumps: int
    fault: str


class LegConditions(NamedTuple):
    """Conditions of one flight."""

    seed: int
    wind: float  # [m/s]
    side: WindySide
    gusts: float  # rms per axis [m/s]
    parameters: float  # greatest relative error of the design model


def fly_leg(conditions: LegConditions, craft: Craft) -> WindyLeg:
    """Fly one."""
    random = np.random.default_rng((conditions.seed, 34))
    course = float(random.uniform(-math.pi, math.pi))  # clockwise from north
    scale = drawn_scale(random, conditions.parameters)
    wind_from = math.degrees(math.remainder(course + conditions.side.azimuth, math.tau))
    edge_on = Start(up=WINDY_HEIGHT, heading=0.5 * math.pi - math.radians(wind_from), airborne=True)
    vehicle = craft.fly(conditions.seed, edge_on, perturbed(craft.model, scale))
    air = WorldSettings(conditions.wind, wind_from, conditions.gusts, battery=1e6)
    aircraft = Aircraft(
        vehicle, STUDY_WORLD, Configuration(Settings(leg_mode=int(LegMode.FORWARD)), vehicle.tuning, air), airborne=True
    )
    positions: list[tuple[float, ...]] = []
    fault, began, reached = "", (0.0, 0.0), (math.nan, math.nan)
    try:
        _advance(aircraft, HOLD_FIRST, positions)
        began = (vehicle.time, vehicle.energy)
        aircraft.autopilot.missions.load(_leg(course))
        aircraft.autopilot.missions.start()
        positions.clear()
        while not has_finished_mission(aircraft) and vehicle.time - began[0] < WINDY_TIME and not _is_down(aircraft):
            _advance(aircraft, SAMPLE_PERIODS / CONTROL_RATE, positions)
        reached = (vehicle.time, vehicle.energy)
        _advance(aircraft, HOLD_LAST, positions)
    except DivergedError as error:
        fault = str(error).split(":")[0]
    return _judged(conditions, aircraft, np.array(positions), course, (began, reached), fault)


def _leg(course: float) -> list[MissionItem]:
    speed = MissionItem(
        command=mavlink.MAV_CMD_DO_CHANGE_SPEED,
        frame=mavlink.MAV_FRAME_MISSION,
        params=(0.0, WINDY_AIRSPEED, -1.0, 0.0),
        x=0,
        y=0,
        z=0.0,
    )
    return [speed, waypoint(WINDY_LENGTH * math.cos(course), -WINDY_LENGTH * math.sin(course), WINDY_HEIGHT)]


def _is_down(aircraft: Aircraft) -> bool:
    return aircraft.vehicle.crash is not None or aircraft.vehicle.law.regime is Regime.GROUND


def _advance(aircraft: Aircraft, seconds: float, positions: list[tuple[float, ...]]) -> None:
    for _ in range(round(seconds * CONTROL_RATE / SAMPLE_PERIODS)):
        if _is_down(aircraft):
            return
        aircraft.advance(SAMPLE_PERIODS)
        positions.append(aircraft.vehicle.truth.body.position)


def _judged(
    conditions: LegConditions,
    aircraft: Aircraft,
    p: Array,
    course: float,
    marks: tuple[tuple[float, float], tuple[float, float]],
    fault: str,
) -> WindyLeg:
    vehicle, (began, reached) = aircraft.vehicle, marks
    down = _is_down(aircraft)
    fault = fault or ("on the ground" if down else "" if has_finished_mission(aircraft) else "late")
    c, s = math.cos(course), math.sin(course)
    along, aside = c * p[:, 0] - s * p[:, 1], s * p[:, 0] + c * p[:, 1]
    last = round(LAST_SECONDS * CONTROL_RATE / SAMPLE_PERIODS)
    off = np.sqrt((along - WINDY_LENGTH) ** 2 + aside**2 + (p[:, 2] - WINDY_HEIGHT) ** 2)[-last:]
    error = math.inf if fault else float(off.mean())
    return WindyLeg(
        seed=conditions.seed,
        wind=conditions.wind,
        side=conditions.side.name,
        done=not fault and error <= REACHED,
        crashed=down,
        error=error,
        beyond=float(along.max()) - WINDY_LENGTH,
        above=float(p[:, 2].max()) - WINDY_HEIGHT,
        aside=float(np.abs(aside).max()),
        energy=reached[1] - began[1],
        time=reached[0] - began[0],
        jumps=len(vehicle.jumps),
        fault=fault,
    )


def summary(legs: Sequence[WindyLeg]) -> list[str]:
    """The flights by wind and side, as lines of text."""
    lines = [
        f"{'wind':>5} {'from':<6}{'legs':>5}{'done':>6}{'crashed':>8}{'error at the end':>20}{'beyond':>8}"
        f"{'above':>8}{'aside':>8}{'energy':>9}{'time':>7}{'jumps':>7}",
        f"{'m/s':>5} {'':<19}{'':>6}{'median / worst [m]':>20}{'[m]':>8}{'[m]':>8}{'[m]':>8}{'[kJ]':>9}{'[s]':>7}",
    ]
    cells = dict.fromkeys((leg.wind, leg.side) for leg in legs)
    lines += [
        _line(f"{wind:>5g} {side:<6}", [r for r in legs if (r.wind, r.side) == (wind, side)]) for wind, side in cells
    ]
    lines.append(_line(f"{'all':<12}", legs))
    lines.append(f"done: {counted(sum(r.done for r in legs), len(legs))}")
    return lines + [
        f"seed {r.seed}, {r.wind:g} m/s, {r.side}: {r.fault or f'{r.error:.1f} m off in the end'}"
        for r in legs
        if not r.done
    ]


def _line(title: str, legs: Sequence[WindyLeg]) -> str:
    errors = [r.error for r in legs]
    worst = [max(getattr(r, name) for r in legs) for name in ("beyond", "above", "aside")]
    energy, time, jumps = (np.nanmedian([getattr(r, name) for r in legs]) for name in ("energy", "time", "jumps"))
    return (
        f"{title}{len(legs):>5}{sum(r.done for r in legs):>6}{sum(r.crashed for r in legs):>8}"
        f"{f'{np.median(errors):.2f} / {max(errors):.2f}':>20}"
        f"{worst[0]:>8.1f}{worst[1]:>8.1f}{worst[2]:>8.1f}{energy / 1e3:>9.2f}{time:>7.1f}{jumps:>7.0f}"
    )


def study_legs(args: argparse.Namespace) -> int:
    """Fly the legs and print how they end; exit code 1 if one is not done or strays."""
    check_seeded(args, {"wind": 30.0, "gusts": 10.0, "parameters": 0.5})
    seeds = range(args.first, args.first + args.flights)
    draws = [
        LegConditions(s, wind, side, args.gusts, args.parameters)
        for wind in args.wind
        for side in WIND_SIDES
        for s in seeds
    ]
    flown = fly_draws(
        partial(fly_leg, craft=craft_of(args)),
        draws,
        args.jobs,
        on_progress=lambda done: print_progress(done, len(draws)),
    )
    print("\n".join(summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [leg._asdict() for leg in flown])
    return 0 if all(leg.done and leg.beyond <= ALLOWED_BEYOND and leg.above <= ALLOWED_ABOVE for leg in flown) else 1
