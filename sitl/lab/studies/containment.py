"""Staying inside a net: requests at random and sticks held towards it, in calm and before a wind wall, many seeds."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from enum import StrEnum
from functools import partial
from typing import NamedTuple

import numpy as np

from protocol.frames import LocalFrame
from sitl import Aircraft, Configuration, DivergedError, Regime, Settings, SitlError, Start, WorldSettings
from sitl.autopilot.manual import Sticks
from sitl.autopilot.world import World
from sitl.defaults import HOME
from sitl.enclosure.arena_files import Arena, load_arena
from sitl.lab.studies.seeded_flights import (
    DEFAULT_CRAFT,
    LOOK_TIME,
    SAMPLE_PERIODS,
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    print_progress,
    write_json,
)

SETTLING_FIRST = 3.0  # before the first request [s]
REQUESTS, REQUEST_TIME = 8, 6.0  # of a flight, and for how long each is flown [s]
STICK_TIME = 2.5  # for which sticks are held, in every second request [s]
MIN_TARGET_HEIGHT = 1.2  # [m]
HOLD_WORDS = "m from the net: holding"  # of the alarm
BURST_TIME = 1.5  # of the 1-cos gusts, one a request [s]


class ContainmentEnd(StrEnum):
    """End of a flight under a net, the gravest first."""

    TOUCHED = "touched"
    CUT = "cut"
    CRASHED = "crashed"
    DIVERGED = "diverged"
    LANDED = "landed"
    FLEW_ON = "flew on"


class ContainmentConditions(NamedTuple):
    """Conditions of one flight."""

    seed: int
    wall: float  # speed of the wind wall [m/s]
    burst: float  # rise of its 1-cos gusts [m/s]
    turbulence: float  # intensity [-]


class FlownContainment(NamedTuple):
    """Result of one flight."""

    seed: int
    wall: float  # [m/s]
    burst: float  # [m/s]
    end: ContainmentEnd
    room: float  # least distance of the centre of mass from net and obstacles [m]
    holds: int  # alarms that stopped a request
    refused: int  # requests of points outside, all of which must be refused
    accepted_outside: int  # of these, those that were not


def fly_containment(
    conditions: ContainmentConditions, arena: str = "voliere", craft: Craft = DEFAULT_CRAFT
) -> FlownContainment:
    """Fly one."""
    room = load_arena(arena)
    if not room.has_net:
        raise SitlError(f"--arena {arena}: there is no net")
    aircraft, random = enclosed(conditions, room, craft), np.random.default_rng((conditions.seed, 7))
    least, holds, refused, accepted, flaw = math.inf, 0, 0, 0, ""
    sticks = Sticks()
    try:
        for step in range(round((SETTLING_FIRST + REQUESTS * REQUEST_TIME) / LOOK_TIME)):
            elapsed = step * LOOK_TIME - SETTLING_FIRST
            if elapsed >= 0.0 and abs(elapsed % REQUEST_TIME) < 0.5 * LOOK_TIME:
                denied, let_in = _request_outside(aircraft, room, random)
                refused, accepted = refused + denied, accepted + let_in
                sticks = _request(aircraft, room, random, by_sticks=round(elapsed / REQUEST_TIME) % 2 == 1)
                if conditions.burst > 0.0:
                    aircraft.vehicle.surroundings.begin_burst(aircraft.vehicle.time, BURST_TIME, conditions.burst)
            if elapsed >= 0.0 and elapsed % REQUEST_TIME < STICK_TIME:
                aircraft.autopilot.manual.take_sticks(sticks)
            aircraft.advance(SAMPLE_PERIODS)
            least = min(least, room.room(aircraft.vehicle.truth.body.position)[0])
            holds += sum(HOLD_WORDS in notice.text for notice in aircraft.autopilot.notices())
            if _is_over(aircraft):
                break
    except DivergedError as error:
        flaw = str(error)
    end = ContainmentEnd.DIVERGED if flaw else _end(aircraft)
    return FlownContainment(conditions.seed, conditions.wall, conditions.burst, end, least, holds, refused, accepted)


def enclosed(conditions: ContainmentConditions, arena: Arena, craft: Craft) -> Aircraft:
    """A vehicle that hovers in the middle of an arena, the wall blowing."""
    vehicle = craft.fly(conditions.seed, Start(arena.north, arena.west, 0.4 * arena.height, airborne=True))
    air = WorldSettings(battery=1e6, wall_speed=conditions.wall, wall_turbulence=conditions.turbulence)
    world = World(LocalFrame(HOME), arena)
    return Aircraft(vehicle, world, Configuration(Settings(), vehicle.tuning, air), airborne=True)


def _request(aircraft: Aircraft, arena: Arena, random: np.random.Generator, *, by_sticks: bool) -> Sticks:
    """Go to any point inside, or hold the sticks, which it gives, in any direction."""
    a, b, c = (float(x) for x in random.uniform(-1.0, 1.0, 3))
    if by_sticks:
        sticks = Sticks(a, b, 0.3 * c)
        aircraft.autopilot.manual.take_sticks(sticks)
        aircraft.autopilot.manual.start()
        return sticks
    p = arena.outside(a * (arena.half_length - arena.margin), b * (arena.half_width - arena.margin))
    highest = arena.height - arena.margin
    aircraft.autopilot.guided.go_to((p[0], p[1], MIN_TARGET_HEIGHT + 0.5 * (1.0 + c) * (highest - MIN_TARGET_HEIGHT)))
    return Sticks()


def _request_outside(aircraft: Aircraft, arena: Arena, random: np.random.Generator) -> tuple[int, int]:
    """Ask for a point beyond the margin: refused, accepted."""
    ahead = float(random.uniform(arena.half_length - 0.9 * arena.margin, 2.0 * arena.half_length))
    p = arena.outside(ahead if random.uniform() < 0.5 else -ahead, 0.0)
    answer = aircraft.autopilot.guided.go_to((p[0], p[1], 2.0))
    return (0, 1) if answer.result == 0 else (1, 0)


def _is_over(aircraft: Aircraft) -> bool:
    vehicle = aircraft.vehicle
    return vehicle.crash is not None or vehicle.law.regime is Regime.GROUND


def _end(aircraft: Aircraft) -> ContainmentEnd:
    vehicle = aircraft.vehicle
    if vehicle.surroundings.touched:
        return ContainmentEnd.TOUCHED
    if aircraft.autopilot.terminated:
        return ContainmentEnd.CUT
    if vehicle.crash is not None:
        return ContainmentEnd.CRASHED
    return ContainmentEnd.LANDED if vehicle.law.regime is Regime.GROUND else ContainmentEnd.FLEW_ON


def summary(flights: Sequence[FlownContainment]) -> list[str]:
    """The flights by wind and gust, as lines of text."""
    ends = (ContainmentEnd.TOUCHED, ContainmentEnd.CUT, ContainmentEnd.LANDED, ContainmentEnd.FLEW_ON)
    head = f"{'wall':>6}{'gust':>6}{'flights':>9}{'least room, median / 1 in 20 / least [m]':>44}{'holds':>8}"
    lines = [head + "".join(f"{end.value:>9}" for end in ends) + f"{'others':>8}"]
    for wall, burst in sorted({(flight.wall, flight.burst) for flight in flights}):
        group = [flight for flight in flights if (flight.wall, flight.burst) == (wall, burst)]
        room = [flight.room for flight in group]
        counts = [sum(flight.end is end for flight in group) for end in ends]
        figures = f"{np.median(room):.2f} / {np.quantile(room, 0.05):.2f} / {min(room):.2f}"
        lines.append(
            f"{wall:>6g}{burst:>6g}{len(group):>9}{figures:>44}{sum(f.holds for f in group) / len(group):>8.1f}"
            + "".join(f"{count:>9}" for count in counts)
            + f"{len(group) - sum(counts):>8}"
        )
    wrong = sum(flight.accepted_outside for flight in flights)
    asked = wrong + sum(flight.refused for flight in flights)
    return [*lines, f"points outside: {asked} asked for, {wrong} accepted"]


def study_containment(args: argparse.Namespace) -> int:
    """Fly and print; exit code 1 if a point outside was accepted, or the net was touched in calm."""
    check_seeded(args, {"wall": 30.0, "bursts": 30.0, "turbulence": 1.0})

    load_arena(args.arena)
    seeds = range(args.first, args.first + args.flights)
    winds = [(wall, burst) for wall in args.wall for burst in args.bursts if wall > 0.0 or burst == args.bursts[0]]
    conditions = [
        ContainmentConditions(seed, wall, burst if wall > 0.0 else 0.0, args.turbulence)
        for wall, burst in winds
        for seed in seeds
    ]
    fly = partial(fly_containment, arena=args.arena, craft=craft_of(args))
    flown = fly_draws(fly, conditions, args.jobs, on_progress=partial(print_progress, of=len(conditions)))
    print("\n".join(summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [flight._asdict() for flight in flown])
    return 0 if stayed_inside(flown) else 1


def stayed_inside(flown: Sequence[FlownContainment]) -> bool:
    """Whether no point outside was accepted, and every flight in calm flew on."""
    calm = [flight for flight in flown if flight.wall == 0.0]
    return not any(flight.accepted_outside for flight in flown) and all(flight.end == "flew on" for flight in calm)
