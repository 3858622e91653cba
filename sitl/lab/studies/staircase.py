"""The staircase of winds that DarkO flew before a wind wall: flown by each controller, beside what the flight measured.

The flight's values are those of :mod:`sitl.lab.validation.wall_flight`; its thrusts were reckoned from speeds, as here.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from protocol.frames import LocalFrame
from sitl import Aircraft, Array, Configuration, DivergedError, Settings, SitlError, Start, WorldSettings
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
from sitl.lab.study_options import PAPARAZZI
from sitl.lab.validation.wall_flight import FLIGHT, FLIGHT_THRUST, RPM, SteadyFlight
from sitl.simulation.tuning import CONTROLLERS

FLOWN_DEVIATION = (0.048, 0.034, 0.028)  # of its position, along the wind, across, up [m]
SIZE_FACTOR = 2.0  # times more, or less, than the flight's deviations is still their size
STAIR_RISE, STAIR_LEAD = 2.0, 10.0  # of a wind; before the first [s]
STAIR_SETTLING = 4.0  # at the beginning of a step, not looked at [s]
STAIR_HEIGHT, WALL_DISTANCE = 2.0, 2.5  # where it hovers [m]
FLEW = "robust-pi"


class StairDraw(NamedTuple):
    """One flight: its controller and seed."""

    controller: str
    seed: int


class FlownStaircase(NamedTuple):
    """Result of one flight."""

    controller: str
    seed: int
    steps: tuple[SteadyFlight, ...]
    deviation: tuple[float, float, float]  # of the position, along the wind, across, up [m]
    farthest: float  # from the set-point [m]
    busy: float  # rms of the elevons' rate [deg/s]
    laws: tuple[str, ...]  # that flew it
    fault: str = ""  # why it ended; empty if it did not


def schedule_of(winds: Sequence[float], hold: float) -> tuple[tuple[float, float], ...]:
    """The wall's schedule: each wind held so long [s] after its rise; times [s], speeds [m/s]."""
    lines, time, before = [(0.0, winds[0])], STAIR_LEAD + hold, winds[0]
    for wind in winds[1:]:
        lines += [(time, before), (time + STAIR_RISE, wind)]
        time, before = time + STAIR_RISE + hold, wind
    return tuple(lines)


def fly_staircase(draw: StairDraw, winds: Sequence[float], hold: float, craft: Craft = DEFAULT_CRAFT) -> FlownStaircase:
    """Fly one staircase, the belly to the wall.

    Args:
        draw: The controller and the seed.
        winds: Of the wall [m/s].
        hold: How long each is held [s].
        craft: What flies; its controller is that of the draw.
    """
    aircraft, target = _before_the_wall(draw, winds, hold, craft)
    looks, laws, fault = [], [], ""
    duration = schedule_of(winds, hold)[-1][0] + (hold if len(winds) > 1 else STAIR_LEAD + hold)
    try:
        for look in range(round(duration / LOOK_TIME)):
            aircraft.advance(SAMPLE_PERIODS)
            body, now = aircraft.vehicle.truth.body, aircraft.vehicle.truth.actuators
            q = body.attitude
            looks.append((look * LOOK_TIME, *body.position, 2.0 * (q.x * q.z - q.w * q.y), *now))
            laws.append(aircraft.vehicle.law.label)
            if aircraft.vehicle.crash is not None:
                fault = f"crashed into {aircraft.vehicle.surroundings.touched or 'the ground'}"
                break
    except DivergedError as error:
        fault = str(error).split(":")[0]
    return _result(draw, np.array(looks), np.array(target), (winds, hold), tuple(dict.fromkeys(laws)), fault)


def _before_the_wall(
    draw: StairDraw, winds: Sequence[float], hold: float, craft: Craft
) -> tuple[Aircraft, tuple[float, float, float]]:
    room = _room(schedule_of(winds, hold))
    assert room.wall is not None  # noqa: S101 - :func:`_room` made it
    (north, west, _), along = room.wall.outlet.centre, room.wall.outlet.along
    target = (north + WALL_DISTANCE * along.x, west + WALL_DISTANCE * along.y, STAIR_HEIGHT)
    facing = math.atan2(-along.y, -along.x)
    flown = craft._replace(controller=draw.controller)
    vehicle = flown.fly(draw.seed, Start(*target, heading=facing, airborne=True))
    air = WorldSettings(battery=1e6)
    configuration = Configuration(Settings(), vehicle.tuning, air)
    aircraft = Aircraft(vehicle, World(LocalFrame(HOME), room), configuration, airborne=True)
    aircraft.autopilot.guided.go_to(target, facing)
    return aircraft, target


def _room(schedule: tuple[tuple[float, float], ...]) -> Arena:
    room = load_arena("voliere")
    if room.wall is None:
        raise SitlError("voliere: there is no wind wall")
    return room._replace(wall=room.wall._replace(schedule=schedule))


def _result(
    draw: StairDraw,
    looks: Array,
    target: Array,
    stairs: tuple[Sequence[float], float],
    laws: tuple[str, ...],
    fault: str,
) -> FlownStaircase:
    if fault:
        return FlownStaircase(*draw, (), (math.inf,) * 3, math.inf, math.inf, laws, fault)
    winds, hold = stairs
    settled = looks[looks[:, 0] >= STAIR_SETTLING]
    steps, begin = [], STAIR_LEAD
    for wind in winds:
        step = settled[(settled[:, 0] >= begin + min(STAIR_SETTLING, 0.5 * hold)) & (settled[:, 0] < begin + hold)]
        steps.append(_means(wind, step))
        begin += hold + STAIR_RISE
    off = settled[:, 1:4] - target
    rates = np.diff(settled[:, 7:9], axis=0) / LOOK_TIME
    return FlownStaircase(
        controller=draw.controller,
        seed=draw.seed,
        steps=tuple(steps),
        deviation=tuple(float(x) for x in off.std(axis=0)),  # type: ignore[arg-type]
        farthest=float(np.linalg.norm(off, axis=1).max()),
        busy=math.degrees(float(np.sqrt(np.mean(rates**2)))),
        laws=laws,
    )


def _means(wind: float, looks: Array) -> SteadyFlight:
    return SteadyFlight(
        wind=wind,
        pitch=math.degrees(float(np.mean(np.arcsin(np.clip(looks[:, 4], -1.0, 1.0))))),
        elevon=math.degrees(float(np.mean(looks[:, 7:9]))),
        thrust=FLIGHT_THRUST * RPM**2 * float(np.mean(looks[:, 5:7] ** 2)),
    )


# The verdict: the law that flew errs as the flight did, and ours no more than it. Paparazzi's constants have no limit.


def is_of_the_flights_size(deviation: Sequence[float]) -> bool:
    """Whether deviations of the position [m] are between half and twice those of the flight, on every axis."""
    return all(
        flown / SIZE_FACTOR <= x <= flown * SIZE_FACTOR for x, flown in zip(deviation, FLOWN_DEVIATION, strict=True)
    )


def deviations(flown: Sequence[FlownStaircase]) -> dict[str, tuple[float, ...]]:
    """Of each controller the deviations of the position, root mean square over its flights [m]."""
    found = {}
    for controller in dict.fromkeys(flight.controller for flight in flown):
        squares = [np.square(flight.deviation) for flight in flown if flight.controller == controller]
        found[controller] = tuple(float(x) for x in np.sqrt(np.mean(squares, axis=0)))
    return found


def faults(flown: Sequence[FlownStaircase]) -> list[str]:
    """Failures of the simulator or of our controllers, in words; none: passed."""
    found = [f"{f.controller}, seed {f.seed}: {f.fault}" for f in flown if f.fault]
    by_controller = deviations(flown)
    reference = by_controller.get(FLEW, FLOWN_DEVIATION)
    if FLEW in by_controller and not is_of_the_flights_size(reference):
        found.append(f"{FLEW} does not err as the flight did")
    worst = float(np.linalg.norm(reference))
    found += [
        f"{controller} errs more than {FLEW if FLEW in by_controller else 'the flight'}"
        for controller, deviation in by_controller.items()
        if controller not in (FLEW, PAPARAZZI) and np.linalg.norm(deviation) > worst
    ]
    return found


def summary(flown: Sequence[FlownStaircase]) -> list[str]:
    """The flight's values and, beside them, the means of each controller, as lines of text."""
    by_controller = deviations(flown)
    lines = [
        "pitch [deg], thrust of a motor [N], mean elevon, nose-up [deg]",
        f"{'wind':>6}{'the flight':>22}" + "".join(f"{name:>22}" for name in by_controller),
    ]
    whole = [flight for flight in flown if not flight.fault]
    for k, wind in enumerate(step.wind for step in (whole[0].steps if whole else ())):
        cells = [_cell(_measured(wind))]
        for name in by_controller:
            group = [flight.steps[k] for flight in whole if flight.controller == name]
            cells.append(_cell(SteadyFlight(*np.mean(group, axis=0).tolist()) if group else None))
        lines.append(f"{wind:>6g}" + "".join(f"{cell:>22}" for cell in cells))
    lines.append("position: std along the wind, across, up [m]; farthest [m]; elevons [deg/s rms]; laws")
    lines.append(f"  {'the flight':<16}" + " ".join(f"{x:.3f}" for x in FLOWN_DEVIATION))
    for name, deviation in by_controller.items():
        by_it = [flight for flight in flown if flight.controller == name]
        busy = math.sqrt(float(np.mean([flight.busy**2 for flight in by_it])))
        laws = ", ".join(dict.fromkeys(law for flight in by_it for law in flight.laws))
        figures = " ".join(f"{x:.3f}" for x in deviation)
        lines.append(f"  {name:<16}{figures}; {max(flight.farthest for flight in by_it):.2f}; {busy:.0f}; {laws}")
    return lines


def _measured(wind: float) -> SteadyFlight | None:
    return next((row.flown for row in FLIGHT if row.flown.wind == wind), None)


def _cell(values: SteadyFlight | None) -> str:
    if values is None:
        return "-"
    thrust = "-" if math.isnan(values.thrust) else f"{values.thrust:.3f}"
    return f"{values.pitch:.1f}  {thrust:>5}  {values.elevon:5.1f}"


def study_staircase(args: argparse.Namespace) -> int:
    """Fly the staircase by each controller and print one table; exit code 1 if the verdict is against one."""
    args.wind = winds = args.wind or [row.flown.wind for row in FLIGHT]
    check_seeded(args, {"wind": 10.0, "hold": 600.0})
    if args.hold < 2.0 * STAIR_SETTLING:
        raise SitlError(f"--hold {args.hold:g} is less than {2.0 * STAIR_SETTLING:g} s")
    draws = [
        StairDraw(controller, seed)
        for controller in ([*CONTROLLERS, PAPARAZZI] if args.controller is None else [args.controller])
        for seed in range(args.first, args.first + args.flights)
    ]
    fly = partial(fly_staircase, winds=winds, hold=args.hold, craft=craft_of(args))
    flown = fly_draws(fly, draws, args.jobs, on_progress=partial(print_progress, of=len(draws)))
    against = faults(flown)
    print("\n".join([*summary(flown), *against, "missed" if against else "passed"]), flush=True)
    if args.json is not None:
        write_json(args.json, [flight._asdict() for flight in flown])
    return int(bool(against))
