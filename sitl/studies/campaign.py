"""A seeded campaign: one mission, many winds, gusts, azimuths and airframes that are not what the laws believe."""

from __future__ import annotations

import math
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from protocol.dialect import mavlink
from protocol.frames import Geodetic, LocalFrame
from protocol.plans.mission import MissionItem
from sitl.airframe import load
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft, is_forward
from sitl.errors import SitlError
from protocol.dialect.vocabulary import Law
from sitl.model.airframe import Airframe, Array
from sitl.parameters import Bindings, Surroundings
from sitl.simulation.simulation import DivergedError, Simulation, Start

if TYPE_CHECKING:
    from matplotlib.axes import Axes

UNCERTAIN = (
    "m", "J1", "J2", "J3", "rho", "C_l", "C_d0", "xi_f", "xi_m", "Delta_r", "a_y", "p_y", "k_f", "k_m", "C_lp", "C_mq",
    "C_nr",
)  # fmt: skip
HEIGHT = 25.0  # of the mission [m]
SIDE = 100.0  # of its square [m]
LOWEST = 5.0  # no flight may come below this [m]
TOO_LONG = 240.0  # [s]
SAMPLE = 10  # control ticks
DRAWN, WORST = 8, 2  # flights whose ground tracks are drawn, and how many of them for their overshoot
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
    cross_track: float  # rms distance to the square on the wing [m]
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
    """Fly one draw; the laws believe the airframe as it is named."""
    return flown(drawn, airframe)[0]


def flown(drawn: Draw, airframe: str = "nominal") -> tuple[Result, Array]:
    """Fly one draw and keep where it went: (n, 4), position in world NWU [m] and whether it was on the wing."""
    believed = load(airframe).parameters
    vehicle = Simulation(
        perturbed(believed, drawn.scale), seed=drawn.seed, design_model=believed, start=Start(up=HEIGHT, airborne=True)
    )
    world = World(LocalFrame(ORIGIN), ARENAS["open"])
    air = Surroundings(drawn.wind_speed, math.degrees(drawn.wind_from), drawn.gusts, battery=1e6)
    craft = Craft(vehicle, world, Bindings(Settings(way=2), vehicle.tuning, air), airborne=True)
    craft.autopilot.load_mission(mission(drawn.azimuth, drawn.airspeed))
    craft.autopilot.start_mission()
    rows: list[tuple[float, ...]] = []
    fault = ""
    try:
        while not _finished(craft) and vehicle.time < TOO_LONG:
            craft.advance(SAMPLE)
            rows.append((*vehicle.truth.body.position, float(is_forward(vehicle.law))))
    except DivergedError as error:
        fault = str(error).split(":")[0]
    if not fault and not _finished(craft):
        fault = f"at item {craft.autopilot.mission.current if craft.autopilot.mission else 0} after {TOO_LONG:.0f} s"
    track = np.array(rows)
    return _result(drawn, vehicle, track, fault), track


def _finished(craft: Craft) -> bool:
    return craft.autopilot.mission is not None and craft.autopilot.mission.finished


def _result(drawn: Draw, vehicle: Simulation, rows: Array, fault: str) -> Result:
    p, winged = rows[:, :3], rows[:, 3] > 0.0
    lowest = float(p[:, 2].min())
    if not fault and lowest < LOWEST:
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
        cross_track=float(np.sqrt(np.mean(_off_square(p[winged, :2], drawn.azimuth) ** 2))) if winged.any() else 0.0,
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


def plot(results: Sequence[Result], path: Path) -> None:
    """Draw overshoot, lowest altitude and time over the wind, and where some of the flights went.

    Raises:
        SitlError: If the file cannot be written; the message names it.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - two seconds that only plots need

    page = Figure(figsize=(10.0, 8.0), layout="constrained")
    axes = page.subplots(2, 2)
    _scatter(axes[0, 0], results, [r.overshoot for r in results], "beyond the last waypoint [m]")
    _scatter(axes[0, 1], results, [r.lowest for r in results], "lowest altitude [m]")
    axes[0, 1].axhline(LOWEST, linestyle="--", linewidth=0.8, color="tab:red")
    _scatter(axes[1, 0], results, [r.time for r in results], "time [s]")
    _tracks(axes[1, 1], _examples(results))
    try:
        page.savefig(path, dpi=90)
    except (OSError, ValueError) as error:
        raise SitlError(f"plot {path}: {error}") from error


def _scatter(axis: Axes, results: Sequence[Result], values: Sequence[float], label: str) -> None:
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


def _examples(results: Sequence[Result]) -> list[Result]:
    """The failures first, then the greatest overshoots, then flights from the least to the most wind."""
    chosen = [r for r in results if not r.complete][: DRAWN - WORST]
    sound = sorted((r for r in results if r.complete), key=lambda r: -r.overshoot)
    chosen += sound[:WORST]
    rest = sorted(sound[WORST:], key=lambda r: r.draw.wind_speed)
    count = min(DRAWN - len(chosen), len(rest))
    return chosen + [rest[i] for i in np.linspace(0, len(rest) - 1, count).round().astype(int)]


def _tracks(axis: Axes, examples: Sequence[Result]) -> None:
    """Ground tracks, each turned so that its first leg points up the page."""
    for r in examples:
        p = flown(r.draw)[1]
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


__all__ = [
    "LOWEST", "Draw", "Result", "Spread", "draw", "flown", "fly", "mission", "perturbed", "plot", "run",
    "summary",
]  # fmt: skip
