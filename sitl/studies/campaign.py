"""A seeded campaign: one mission, many winds, gusts, azimuths, and airframes that differ from the design model."""

from __future__ import annotations

import math
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.frames import Geodetic, LocalFrame
from protocol.plans.mission import MissionItem
from sitl.airframe import load
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft, is_forward
from sitl.errors import SitlError
from sitl.model.airframe import Airframe, Array
from sitl.parameters import Bindings, Surroundings
from sitl.simulation.simulation import DivergedError, Simulation, Start

UNCERTAIN = (
    "m", "J1", "J2", "J3", "rho", "C_l", "C_d0", "xi_f", "xi_m", "Delta_r", "a_y", "p_y", "k_f", "k_m", "C_lp", "C_mq",
    "C_nr",
)  # fmt: skip
HEIGHT = 25.0  # of the mission [m]
SIDE = 100.0  # of its square [m]
MIN_HEIGHT = 5.0  # no flight may come below this [m]
MAX_TIME = 240.0  # [s]
SAMPLE = 10  # control periods
ORIGIN = Geodetic(43.5648, 1.4811, 150.0)


class Draw(NamedTuple):
    """What one flight meets."""

    seed: int
    azimuth: float  # of the first leg, from north to west [rad]
    wind_speed: float  # [m/s]
    wind_from: float  # where it comes from, clockwise from north [rad]
    gusts: float  # rms per axis [m/s]
    airspeed: float  # [m/s]
    scale: dict[str, float]  # of the plant's parameters


class Result(NamedTuple):
    """How one flight went."""

    draw: Draw
    complete: bool
    time: float  # until the last waypoint [s]
    energy: float  # until then [J]
    lowest: float  # above the ground [m]
    overshoot: float  # beyond the stop at the end of the last leg [m]
    climbed: float  # over the mission's altitude [m]
    cross_track: float  # rms distance to the square in forward flight [m]
    jumps: int
    failsafes: int
    fault: str  # why it is not complete; empty if it is


class Spread(NamedTuple):
    """How far the draws go."""

    wind: float = 5.0  # [m/s]
    gusts: float = 1.0  # rms [m/s]
    parameters: float = 0.1  # relative
    airspeeds: tuple[float, float] = (12.0, 18.0)  # [m/s]


def draw(seed: int, spread: Spread) -> Draw:
    """The conditions of one seed."""
    random = np.random.default_rng(seed)
    azimuth, wind_from = random.uniform(0.0, math.tau, 2)
    return Draw(
        seed=seed,
        azimuth=float(azimuth),
        wind_speed=float(random.uniform(0.0, spread.wind)),
        wind_from=float(wind_from),
        gusts=float(random.uniform(0.0, spread.gusts)),
        airspeed=float(random.uniform(*spread.airspeeds)),
        scale={name: 1.0 + float(random.uniform(-1.0, 1.0)) * spread.parameters for name in UNCERTAIN},
    )


def mission(azimuth: float, airspeed: float) -> list[MissionItem]:
    """A square that begins and ends in the hover, its last waypoint held for two seconds."""
    corners = [corner(i, azimuth) for i in range(1, 5)]
    speed = MissionItem(
        mavlink.MAV_CMD_DO_CHANGE_SPEED, mavlink.MAV_FRAME_MISSION, (0.0, airspeed, -1.0, 0.0), 0, 0, 0.0
    )
    items = [speed]
    for i, (north, west) in enumerate(corners):
        params = (2.0 if i == 3 else 0.0, 0.0, 0.0, math.nan)
        items.append(
            MissionItem(
                mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_FRAME_LOCAL_NED, params, round(north * 1e4),
                round(-west * 1e4), -HEIGHT,
            )
        )  # fmt: skip
    return items


def corner(i: int, azimuth: float) -> tuple[float, float]:
    """Corner i of the square, 0 and 4 being the origin: north, west [m]."""
    x, y = ((0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE), (0.0, 0.0))[i]
    c, s = math.cos(azimuth), math.sin(azimuth)
    return c * x - s * y, s * x + c * y


def perturbed(a: Airframe, scale: dict[str, float]) -> Airframe:
    """An airframe with some parameters scaled."""
    return a._replace(**{name: getattr(a, name) * factor for name, factor in scale.items()})


def fly(drawn: Draw, airframe: str = "nominal") -> Result:
    """Fly one draw; the airframe of that name is the design model."""
    return flown(drawn, airframe)[0]


def flown(drawn: Draw, airframe: str = "nominal") -> tuple[Result, Array]:
    """Fly one draw and keep where it went: (n, 4), position in world NWU [m] and whether it flew forward."""
    model, start = load(airframe).parameters, Start(up=HEIGHT, airborne=True)
    vehicle = Simulation(perturbed(model, drawn.scale), seed=drawn.seed, design_model=model, start=start)
    world = World(LocalFrame(ORIGIN), ARENAS["open"])
    air = Surroundings(drawn.wind_speed, math.degrees(drawn.wind_from), drawn.gusts, battery=1e6)
    craft = Craft(vehicle, world, Bindings(Settings(way=2), vehicle.tuning, air), airborne=True)
    craft.autopilot.load_mission(mission(drawn.azimuth, drawn.airspeed))
    craft.autopilot.start_mission()
    rows: list[tuple[float, ...]] = []
    fault = ""
    try:
        while not _finished(craft) and vehicle.time < MAX_TIME:
            craft.advance(SAMPLE)
            rows.append((*vehicle.truth.body.position, float(is_forward(vehicle.law))))
    except DivergedError as error:
        fault = str(error).split(":")[0]
    if not fault and not _finished(craft):
        fault = f"at item {craft.autopilot.mission.current if craft.autopilot.mission else 0} after {MAX_TIME:.0f} s"
    track = np.array(rows)
    return _result(drawn, vehicle, track, fault), track


def _finished(craft: Craft) -> bool:
    return craft.autopilot.mission is not None and craft.autopilot.mission.finished


def _result(drawn: Draw, vehicle: Simulation, rows: Array, fault: str) -> Result:
    p, forward = rows[:, :3], rows[:, 3] > 0.0
    lowest = float(p[:, 2].min())
    if not fault and lowest < MIN_HEIGHT:
        fault = f"came down to {lowest:.1f} m"
    last = np.array(corner(4, drawn.azimuth)) - np.array(corner(3, drawn.azimuth))
    beyond = (p[:, :2] @ last)[len(p) // 2 :] / SIDE
    return Result(
        draw=drawn,
        complete=not fault,
        time=vehicle.time,
        energy=vehicle.energy,
        lowest=lowest,
        overshoot=float(beyond.max()),
        climbed=float(p[:, 2].max() - HEIGHT),
        cross_track=float(np.sqrt(np.mean(_off_square(p[forward, :2], drawn.azimuth) ** 2))) if forward.any() else 0.0,
        jumps=len(vehicle.jumps),
        failsafes=sum(jump.target is Law.FAILSAFE for jump in vehicle.jumps),
        fault=fault,
    )


def _off_square(p: Array, azimuth: float) -> Array:
    """Distance to the nearest side of the square, (n,) [m]."""
    nearest = np.full(len(p), np.inf)
    for i in range(4):
        a, b = np.array(corner(i, azimuth)), np.array(corner(i + 1, azimuth))
        along = np.clip((p - a) @ (b - a) / SIDE**2, 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(p - a - along[:, None] * (b - a), axis=1))
    return nearest


def run(
    flights: int,
    first: int = 1,
    spread: Spread | None = None,
    jobs: int = 2,
    said: Callable[[int], None] = lambda done: None,  # noqa: ARG005 - silence is the default
) -> list[Result]:
    """Fly seeds ``first`` to ``first + flights - 1``; the results are in their order whatever the jobs are.

    Raises:
        SitlError: If there is nothing to fly.
    """
    if flights < 1 or jobs < 1:
        raise SitlError(f"{flights} flights by {jobs} processes: both must be at least 1")
    draws = [draw(first + i, spread or Spread()) for i in range(flights)]
    results = []
    for result in _flown(draws, jobs):
        results.append(result)
        said(len(results))
    return results


def _flown(draws: Sequence[Draw], jobs: int) -> Iterator[Result]:
    if jobs == 1:
        yield from map(fly, draws)
        return
    quiet = signal.signal, (signal.SIGINT, signal.SIG_DFL)  # an interrupted worker ends without a word
    with ProcessPoolExecutor(min(jobs, len(draws)), get_context("spawn"), *quiet) as pool:
        try:
            yield from pool.map(fly, draws, chunksize=4)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def summary(results: Sequence[Result]) -> list[str]:
    """What the campaign came to, failures with their seeds, as lines of text."""
    complete = [r for r in results if r.complete]
    lines = [
        f"{len(results)} flights, seeds {results[0].draw.seed} to {results[-1].draw.seed}",
        f"complete: {len(complete)} ({100 * len(complete) / len(results):.1f} %)",
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


def _failure(r: Result) -> str:
    d = r.draw
    return (
        f"failed: seed {d.seed}: {r.fault} (wind {d.wind_speed:.1f} m/s from {math.degrees(d.wind_from):.0f} deg, "
        f"gusts {d.gusts:.2f} m/s, first leg {math.degrees(d.azimuth):.0f} deg to the west, {d.airspeed:.1f} m/s)"
    )
