"""A seeded campaign: one mission, many winds, gusts, azimuths, and airframes that differ from the design model."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.plans.plan import MissionItem
from sitl import (
    Aircraft,
    Array,
    Configuration,
    DivergedError,
    Law,
    Settings,
    Simulation,
    Start,
    WorldSettings,
)
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
from sitl.tools.plotting import blank_page, check_plot_path, save_page
from sitl.vehicle.aircraft import is_forward

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from sitl.lab.studies.seeded_flights import Craft


MISSION_HEIGHT = 25.0  # [m]
SQUARE_SIDE = 100.0  # of the mission's square [m]
LAST_WAYPOINT_HOLD = 2.0  # [s]
MIN_FLIGHT_HEIGHT = 5.0  # a flight that comes lower has failed [m]
MAX_MISSION_TIME = 240.0  # [s]
FLIGHTS_PER_TASK = 4  # handed to a worker process at once


class FlightConditions(NamedTuple):
    """Conditions of one flight, drawn from its seed."""

    seed: int
    azimuth: float  # of the first leg, from north to west [rad]
    wind_speed: float  # [m/s]
    wind_from: float  # where it comes from, clockwise from north [rad]
    gusts: float  # rms per axis [m/s]
    airspeed: float  # [m/s]
    scale: dict[str, float]  # factor of each uncertain parameter of the plant


class CampaignFlight(NamedTuple):
    """Result of one flight."""

    draw: FlightConditions
    complete: bool
    time: float  # until the last waypoint [s]
    energy: float  # until then [J]
    lowest: float  # above the ground [m]
    overshoot: float  # beyond the stop at the end of the last leg [m]
    climbed: float  # above the mission's altitude [m]
    cross_track: float  # rms distance to the square in forward flight [m]
    jumps: int
    failsafes: int
    fault: str  # why it is not complete; empty if it is


class GroundTrack(NamedTuple):
    """Track of a flight, one row per look."""

    position: Array  # (n, 3) world NWU [m]
    forward: npt.NDArray[np.bool_]  # (n,) whether it flew forward


class Spread(NamedTuple):
    """Limits of the draws."""

    wind: float = 5.0  # maximum steady wind [m/s]
    gusts: float = 1.0  # maximum rms per axis [m/s]
    parameters: float = 0.1  # maximum relative error
    airspeeds: tuple[float, float] = (12.0, 18.0)  # minimum and maximum [m/s]


def draw(seed: int, spread: Spread) -> FlightConditions:
    """The conditions of one seed."""
    random = np.random.default_rng(seed)
    azimuth, wind_from = random.uniform(0.0, math.tau, 2)
    return FlightConditions(
        seed=seed,
        azimuth=float(azimuth),
        wind_speed=float(random.uniform(0.0, spread.wind)),
        wind_from=float(wind_from),
        gusts=float(random.uniform(0.0, spread.gusts)),
        airspeed=float(random.uniform(*spread.airspeeds)),
        scale=drawn_scale(random, spread.parameters),
    )


def mission(azimuth: float, airspeed: float) -> list[MissionItem]:
    """A square that begins and ends in the hover, its last waypoint held for two seconds.

    Args:
        azimuth: Of the first leg, from north to west [rad].
        airspeed: [m/s].
    """
    params = (0.0, airspeed, -1.0, 0.0)
    speed = MissionItem(
        command=mavlink.MAV_CMD_DO_CHANGE_SPEED, frame=mavlink.MAV_FRAME_MISSION, params=params, x=0, y=0, z=0.0
    )
    holds = (0.0, 0.0, 0.0, LAST_WAYPOINT_HOLD)
    corners = [waypoint(*corner(number, azimuth), MISSION_HEIGHT, hold) for number, hold in enumerate(holds, start=1)]
    return [speed, *corners]


def corner(number: int, azimuth: float) -> tuple[float, float]:
    """A corner of the square, 0 and 4 being the origin: north, west [m]."""
    x, y = ((0.0, 0.0), (SQUARE_SIDE, 0.0), (SQUARE_SIDE, SQUARE_SIDE), (0.0, SQUARE_SIDE), (0.0, 0.0))[number]
    c, s = math.cos(azimuth), math.sin(azimuth)
    return c * x - s * y, s * x + c * y


def fly(conditions: FlightConditions, craft: Craft = DEFAULT_CRAFT) -> CampaignFlight:
    """Fly one draw."""
    return fly_and_track(conditions, craft)[0]


def fly_and_track(conditions: FlightConditions, craft: Craft = DEFAULT_CRAFT) -> tuple[CampaignFlight, GroundTrack]:
    """Fly one draw and record where it went; arguments as for :func:`fly`."""
    airframe, start = perturbed(craft.model, conditions.scale), Start(up=MISSION_HEIGHT, airborne=True)
    vehicle = craft.fly(conditions.seed, start, airframe)
    air = WorldSettings(conditions.wind_speed, math.degrees(conditions.wind_from), conditions.gusts, battery=1e6)
    settings = Configuration(Settings(leg_mode=int(LegMode.FORWARD)), vehicle.tuning, air)
    aircraft = Aircraft(vehicle, STUDY_WORLD, settings, airborne=True)
    aircraft.autopilot.missions.load(mission(conditions.azimuth, conditions.airspeed))
    aircraft.autopilot.missions.start()
    positions: list[tuple[float, ...]] = []
    forward: list[bool] = []
    fault = ""
    try:
        while not has_finished_mission(aircraft) and vehicle.time < MAX_MISSION_TIME and vehicle.crash is None:
            aircraft.advance(SAMPLE_PERIODS)
            positions.append(vehicle.truth.body.position)
            forward.append(is_forward(vehicle))
    except DivergedError as error:
        fault = str(error).split(":")[0]
    if vehicle.crash is not None:
        fault = f"crashed at {vehicle.crash.speed:.1f} m/s"
    if not fault and not has_finished_mission(aircraft):
        mission_runner = aircraft.autopilot.mission
        fault = f"at item {mission_runner.current if mission_runner else 0} after {MAX_MISSION_TIME:.0f} s"
    track = GroundTrack(np.array(positions), np.array(forward))
    return _summarise(conditions, vehicle, track, fault), track


def _summarise(conditions: FlightConditions, vehicle: Simulation, track: GroundTrack, fault: str) -> CampaignFlight:
    p = track.position
    lowest = float(p[:, 2].min())
    if not fault and lowest < MIN_FLIGHT_HEIGHT:
        fault = f"came down to {lowest:.1f} m"
    last_leg = np.array(corner(4, conditions.azimuth)) - np.array(corner(3, conditions.azimuth))
    beyond = (p[:, :2] @ last_leg)[len(p) // 2 :] / SQUARE_SIDE
    forward = p[track.forward, :2]
    cross_track = float(np.sqrt(np.mean(_off_square(forward, conditions.azimuth) ** 2))) if forward.size else 0.0
    return CampaignFlight(
        draw=conditions,
        complete=not fault,
        time=vehicle.time,
        energy=vehicle.energy,
        lowest=lowest,
        overshoot=float(beyond.max()),
        climbed=float(p[:, 2].max() - MISSION_HEIGHT),
        cross_track=cross_track,
        jumps=len(vehicle.jumps),
        failsafes=sum(jump.target is Law.FAILSAFE for jump in vehicle.jumps),
        fault=fault,
    )


def _off_square(p: Array, azimuth: float) -> Array:
    """Distance to the nearest side of the square, (n,) [m]."""
    nearest = np.full(len(p), np.inf)
    for i in range(4):
        a, b = np.array(corner(i, azimuth)), np.array(corner(i + 1, azimuth))
        along = np.clip((p - a) @ (b - a) / SQUARE_SIDE**2, 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(p - a - along[:, None] * (b - a), axis=1))
    return nearest


def run(
    flights: int,
    first: int = 1,
    spread: Spread | None = None,
    jobs: int = 2,
    on_progress: Callable[[int], None] = ignore_progress,
    craft: Craft = DEFAULT_CRAFT,
) -> list[CampaignFlight]:
    """Fly seeds ``first`` to ``first + flights - 1``; their order and results do not depend on the jobs.

    Args:
        flights: How many.
        first: Seed of the first flight.
        spread: Limits of the draws.
        jobs: Processes at once.
        on_progress: Called with the number of flights done, after each.
        craft: What is flown.

    Raises:
        SitlError: If there is nothing to fly, or no such seed.
    """
    draws = [draw(seed, spread or Spread()) for seed in seeds(flights, first)]
    return fly_draws(partial(fly, craft=craft), draws, jobs, FLIGHTS_PER_TASK, on_progress)


def summary(results: Sequence[CampaignFlight]) -> list[str]:
    """The campaign's statistics and its failures with their seeds, as lines of text."""
    complete = [r for r in results if r.complete]
    lines = [
        f"{len(results)} flights, seeds {results[0].draw.seed} to {results[-1].draw.seed}",
        f"complete: {counted(len(complete), len(results))}",
        f"lowest of all: {min(r.lowest for r in results):.1f} m",
    ]
    columns = (
        ("time [s]", [r.time for r in complete]),
        ("energy [kJ]", [r.energy / 1e3 for r in complete]),
        ("cross-track rms [m]", [r.cross_track for r in complete]),
        ("overshoot [m]", [r.overshoot for r in complete]),
        ("climbed over the mission [m]", [r.climbed for r in complete]),
        ("jumps", [float(r.jumps) for r in complete]),
    )
    lines += [f"{'':<30}{'median':>9}{'p90':>9}{'max':>9}"]
    lines += [f"{name:<30}{np.median(v):9.1f}{np.quantile(v, 0.9):9.1f}{max(v):9.1f}" for name, v in columns if v]
    lines += [_failure(r) for r in results if not r.complete]
    return lines


def _failure(r: CampaignFlight) -> str:
    d = r.draw
    return (
        f"failed: seed {d.seed}: {r.fault} (wind {d.wind_speed:.1f} m/s from {math.degrees(d.wind_from):.0f} deg, "
        f"gusts {d.gusts:.2f} m/s, first leg {math.degrees(d.azimuth):.0f} deg to the west, {d.airspeed:.1f} m/s)"
    )


# A page of a campaign: overshoot, lowest altitude and time over the wind, and where some of the flights went.


DRAWN_TRACKS = 8  # flights whose ground tracks are drawn
WORST_TRACKS = 2  # of these, how many are chosen for their overshoot


def save_plot(results: Sequence[CampaignFlight], craft: Craft, path: Path) -> None:
    """Draw overshoot, lowest altitude and time over the wind, and where some of the flights went with that craft.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(10.0, 8.0)
    axes = page.subplots(2, 2)
    _scatter(axes[0, 0], results, [r.overshoot for r in results], "beyond the last waypoint [m]")
    _scatter(axes[0, 1], results, [r.lowest for r in results], "lowest altitude [m]")
    axes[0, 1].axhline(MIN_FLIGHT_HEIGHT, linestyle="--", linewidth=0.8, color="tab:red")
    _scatter(axes[1, 0], results, [r.time for r in results], "time [s]")
    _tracks(axes[1, 1], _examples(results), craft)
    save_page(page, path, dpi=90)


def _scatter(axis: Axes, results: Sequence[CampaignFlight], values: Sequence[float], label: str) -> None:
    for complete, colour, name in ((True, "tab:blue", "complete"), (False, "tab:red", "failed")):
        chosen = [
            (r.draw.wind_speed, value) for r, value in zip(results, values, strict=True) if r.complete is complete
        ]
        if chosen:
            axis.plot(*zip(*chosen, strict=True), linestyle="", marker=".", color=colour, label=name)
    axis.set_xlabel("wind [m/s]")
    axis.set_ylabel(label)
    if not all(r.complete for r in results):
        axis.legend(loc="best", fontsize=8)
    axis.grid(alpha=0.3)


def _examples(results: Sequence[CampaignFlight]) -> list[CampaignFlight]:
    """The failures first, then the greatest overshoots, then flights in order of wind."""
    chosen = [r for r in results if not r.complete][: DRAWN_TRACKS - WORST_TRACKS]
    sound = sorted((r for r in results if r.complete), key=lambda r: -r.overshoot)
    chosen += sound[:WORST_TRACKS]
    rest = sorted(sound[WORST_TRACKS:], key=lambda r: r.draw.wind_speed)
    count = min(DRAWN_TRACKS - len(chosen), len(rest))
    return chosen + [rest[i] for i in np.linspace(0, len(rest) - 1, count).round().astype(int)]


def _tracks(axis: Axes, examples: Sequence[CampaignFlight], craft: Craft) -> None:
    """Ground tracks, each turned so that its first leg points up the page."""
    for r in examples:
        p = fly_and_track(r.draw, craft)[1].position
        c, s = math.cos(r.draw.azimuth), math.sin(r.draw.azimuth)
        along, left = c * p[:, 0] + s * p[:, 1], c * p[:, 1] - s * p[:, 0]
        label = f"seed {r.draw.seed}: {r.draw.wind_speed:.1f} m/s" + ("" if r.complete else ", failed")
        axis.plot(-left, along, linewidth=0.9, label=label)
    square = np.array([corner(i, 0.0) for i in range(5)])
    axis.plot(-square[:, 1], square[:, 0], color="black", linestyle=":", linewidth=0.8)
    axis.set_xlabel("right of the first leg [m]")
    axis.set_ylabel("along the first leg [m]")
    axis.set_aspect("equal", adjustable="datalim")
    axis.legend(loc="center", fontsize=7)
    axis.grid(alpha=0.3)


MIN_COMPLETE = 0.97  # share of the flights that must complete


def study_campaign(args: argparse.Namespace) -> int:
    """Fly the campaign and print its figures; exit code 1 if too many fail or one flies too low."""
    check_seeded(args, {"wind": 30.0, "gusts": 10.0, "parameters": 0.5})
    if args.plot is not None:
        check_plot_path(args.plot)

    spread = Spread(args.wind, args.gusts, args.parameters)
    results = run(
        args.flights,
        args.first,
        spread,
        args.jobs,
        on_progress=lambda done: print_progress(done, args.flights),
        craft=craft_of(args),
    )
    print("\n".join(summary(results)), flush=True)
    if args.json is not None:
        write_json(args.json, [result._asdict() | {"draw": result.draw._asdict()} for result in results])
    if args.plot is not None:
        save_plot(results, craft_of(args), args.plot)
    return 0 if passed(results, MIN_FLIGHT_HEIGHT) else 1


def passed(results: Sequence[CampaignFlight], lowest: float) -> bool:
    """Whether enough flights are complete and all stayed above an altitude [m]."""
    complete = sum(result.complete for result in results)
    return complete >= MIN_COMPLETE * len(results) and all(result.lowest >= lowest for result in results)
