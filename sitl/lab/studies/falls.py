"""Falls from any attitude: height lost by the supervisor and by the whole vehicle."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sitl import (
    Aircraft,
    Airframe,
    Array,
    Body,
    Configuration,
    Law,
    Quaternion,
    Regime,
    Settings,
    Simulation,
    Start,
    Tuning,
    Vector,
    WorldSettings,
    fly_batch,
    hover_at,
)
from sitl.lab.studies.proportions import counted
from sitl.lab.studies.seeded_flights import (
    SAMPLE_PERIODS,
    STUDY_WORLD,
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    seeds,
    write_json,
)
from sitl.lab.studies.wrong_models import drawn_scale, perturbed
from sitl.tools.plotting import blank_page, check_plot_path, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# Falls from any attitude: how much height the supervisor needs, beside the zero-moment law alone from the same draws.
#
# A draw is an attitude, uniform over all of them, and a tumble about a random axis; the velocity is that of its kind of
# fall. Flights begin so high that none meets the ground, and fly side by side in batches.

FALL_HEIGHT = 600.0  # where the falls begin whose height is measured [m]
MAX_TUMBLE = 8.0  # [rad/s]
RETURN_SECONDS = 75.0  # after which everything is home
FALL_SECONDS = 30.0  # after which nothing falls any more
SAMPLE_RATE = 25.0  # a second
HOME_RADIUS = 1.0  # [m]
SAME_HEIGHT = 1.0  # heights that differ by less are the same [m]
ALONE = Tuning(v_enter=0.0, v_leave=math.inf)  # nothing ends the law that begins

FALL_KINDS = {
    "5 m/s down": (0.0, 0.0, -5.0),
    "8 m/s down": (0.0, 0.0, -8.0),
    "10 m/s down": (0.0, 0.0, -10.0),
    "13 m/s down": (0.0, 0.0, -13.0),
    "15 m/s down": (0.0, 0.0, -15.0),
    "20 m/s down": (0.0, 0.0, -20.0),
    "12 m/s level, 8 down": (12.0, 0.0, -8.0),
    "18 m/s level": (18.0, 0.0, 0.0),
}
MAP_SINKS = (0.0, 5.0, 10.0, 15.0, 20.0, 25.0)  # [m/s]
MAP_TUMBLES = (0.0, 2.0, 4.0, 6.0, 8.0)  # [rad/s]


class Throw(NamedTuple):
    """Attitude and rates at the beginning of a fall."""

    attitude: Quaternion
    rates: Vector  # [rad/s]


class HeightLost(NamedTuple):
    """Height lost in one kind of fall, one entry per draw."""

    kind: str
    supervisor: Array  # (n,) [m]
    alone: Array  # (n,) by the zero-moment law alone [m]
    away: Array  # (n,) from where it began, in the end [m]

    @property
    def not_home(self) -> int:
        """Flights that are elsewhere in the end."""
        return int(np.count_nonzero(~(self.away <= HOME_RADIUS)))

    @property
    def worse(self) -> int:
        """Draws from which the supervisor loses more than the law alone."""
        return int(np.count_nonzero(~(self.supervisor <= self.alone + SAME_HEIGHT)))


class MapCell(NamedTuple):
    """Height lost from one sink rate and one tumble, upright or not."""

    sink: float  # [m/s]
    tumble: float  # [rad/s]
    lost: Array  # (n,) [m]


def thrown(random: np.random.Generator, tumble: float | None = None) -> Throw:
    """A random attitude, and a tumble about a random axis; its rate is drawn too unless it is given [rad/s]."""
    attitude = random.normal(size=4)
    axis = random.normal(size=3)
    rate = random.uniform(0.0, MAX_TUMBLE) if tumble is None else tumble
    q, w = attitude / np.linalg.norm(attitude), rate * axis / np.linalg.norm(axis)
    return Throw(Quaternion(*(float(x) for x in q)), Vector(*(float(x) for x in w)))


def falling(
    airframe: Airframe,
    seed: int,
    velocity: Iterable[float],
    *,
    tumble: float | None = None,
    law: Law = Law.HOVER_ZERO_MOMENT,
    tuning: Tuning | None = None,
) -> Simulation:
    """A simulation at the beginning of a fall in still air, wanted where it is.

    Args:
        airframe: What falls.
        seed: Of the draw.
        velocity: World NWU [m/s].
        tumble: Its rate [rad/s]; drawn by default.
        law: In force in the beginning.
        tuning: Of the controller.
    """
    throw = thrown(np.random.default_rng(seed), tumble)
    made = Simulation(airframe, seed=seed, start=Start(up=FALL_HEIGHT, airborne=True), tuning=tuning)
    north, west, up = (float(x) for x in velocity)
    made.place(Body(Vector(0.0, 0.0, FALL_HEIGHT), Vector(north, west, up), throw.attitude, throw.rates))
    made.begin_flight(law)
    made.reference = hover_at((0.0, 0.0, FALL_HEIGHT), 0.0)
    return made


def fall(flights: Sequence[Simulation], seconds: float = RETURN_SECONDS) -> tuple[Array, Array]:
    """Fly falls for a time; gives height lost and distance from where they began, (n,) each [m]."""
    recordings = fly_batch(flights, seconds, rate=SAMPLE_RATE)
    lost = [FALL_HEIGHT - float(recording.position[:, 2].min()) for recording in recordings]
    away = [math.dist(flight.truth.body.position, (0.0, 0.0, FALL_HEIGHT)) for flight in flights]
    return np.array(lost), np.array(away)


def heights(airframe: Airframe, flights: int, first: int = 1, tuning: Tuning | None = None) -> list[HeightLost]:
    """Every kind of fall from the same draws, seeds ``first`` on: under the supervisor, and under the law alone.

    Args:
        airframe: What falls.
        flights: Draws of each kind.
        first: Seed of the first.
        tuning: Of the controller under the supervisor.

    Raises:
        SitlError: If there is nothing to fly, or no such seed.
    """
    drawn = seeds(flights, first)
    results = []
    for kind, velocity in FALL_KINDS.items():
        supervisor, away = fall([falling(airframe, seed, velocity, tuning=tuning) for seed in drawn])
        alone, _ = fall([falling(airframe, seed, velocity, tuning=ALONE) for seed in drawn], FALL_SECONDS)
        results.append(HeightLost(kind, supervisor, alone, away))
    return results


def height_map(airframe: Airframe, flights: int, first: int = 1, tuning: Tuning | None = None) -> list[MapCell]:
    """Height lost over sink rate and tumble; arguments as for :func:`heights`."""
    drawn, cells = seeds(flights, first), []
    for sink in MAP_SINKS:
        for tumble in MAP_TUMBLES:
            flown = [falling(airframe, seed, (0.0, 0.0, -sink), tumble=tumble, tuning=tuning) for seed in drawn]
            lost, _ = fall(flown, FALL_SECONDS)
            cells.append(MapCell(sink, tumble, lost))
    return cells


def summary(results: Sequence[HeightLost]) -> list[str]:
    """Height lost by kind of fall, as lines of text: median, nineteen in twenty, the worst."""
    lines = [f"{'height lost [m]':<24}{'supervisor':^24}{'zero-moment law alone':^24}   worse  not home"]
    for r in results:
        figures = "".join(f"{_quantile(lost, share):8.1f}" for lost in (r.supervisor, r.alone) for share in _SHARES)
        lines.append(f"{r.kind:<24}{figures}{r.worse:8d}{r.not_home:10d}")
    return lines


def map_lines(cells: Sequence[MapCell]) -> list[str]:
    """The map as lines of text: median / nineteen in twenty / worst."""
    lines = [f"{'height needed [m]':<18}" + "".join(f"{tumble:>12g} rad/s" for tumble in MAP_TUMBLES)]
    for sink in MAP_SINKS:
        row = [cell for cell in cells if cell.sink == sink]
        figures = [" / ".join(f"{_quantile(cell.lost, share):.0f}" for share in _SHARES) for cell in row]
        lines.append(f"{sink:>4g} m/s down     " + "".join(f"{text:>18}" for text in figures))
    return lines


_SHARES = (0.5, 0.95, 1.0)


def _quantile(values: Array, share: float) -> float:
    return float(np.quantile(values, share))


# Falls of the whole vehicle: under its autopilot, holding over home, thrown into any attitude; calm or in wind.


THROW_HEIGHT = 120.0  # [m]
HOLD_PERIODS = 2000  # control periods before the throw: the wind is known then
SINKS = (5.0, 20.0)  # least and greatest [m/s]
FALL_WIND, FALL_GUSTS = 5.0, 1.0  # steady, and rms per axis [m/s]
FALL_SPREAD = 0.1  # greatest relative error of the airframe's constants in wind
CALM_RADIUS, WINDY_RADIUS = 1.0, 5.0  # nearer than this to where it held is home [m]
HOME_SPEED = 2.0  # [m/s]
HOME_LOOKS = 50  # so long [looks]
MAX_RETURN_TIME = 120.0  # [s]
FALLS_PER_TASK = 8  # handed to a worker process at once


class FallEnd(StrEnum):
    """End of a fall."""

    CRASHED = "crashed"
    HOME = "home"
    LATE = "late"


class AircraftFall(NamedTuple):
    """Result of one fall."""

    seed: int
    velocity: Vector  # it was thrown at, world NWU [m/s]
    end: FallEnd
    lost: float  # height [m]
    time: float  # until the end [s]
    away: float  # from where it held, in the end [m]
    jumps: tuple[str, ...]


def drawn_velocity(random: np.random.Generator) -> Vector:
    """Downwards at any of the sink rates; one in eight 12 m/s level and 8 m/s down, one in eight 18 m/s level."""
    azimuth, kind, sink = random.uniform(0.0, math.tau), int(random.integers(8)), random.uniform(*SINKS)
    c, s = math.cos(azimuth), math.sin(azimuth)
    if kind == 0:
        return Vector(12.0 * c, 12.0 * s, -8.0)
    if kind == 1:
        return Vector(18.0 * c, 18.0 * s, 0.0)
    return Vector(0.0, 0.0, -float(sink))


def fly(seed: int, craft: Craft, *, windy: bool) -> AircraftFall:
    """Fly one draw.

    Args:
        seed: Of everything.
        craft: What falls; in wind it differs from its design model.
        windy: In wind and gusts, the constants of the vehicle off by up to FALL_SPREAD.
    """
    random = np.random.default_rng(seed)
    throw, velocity = thrown(random), drawn_velocity(random)
    aircraft = _hovering(seed, craft, random, windy=windy)
    aircraft.advance(HOLD_PERIODS)
    return _followed(aircraft, seed, throw, velocity, WINDY_RADIUS if windy else CALM_RADIUS)


def _hovering(seed: int, craft: Craft, random: np.random.Generator, *, windy: bool) -> Aircraft:
    airframe, air = craft.model, WorldSettings(battery=1e6)
    if windy:
        scale = drawn_scale(random, FALL_SPREAD)
        airframe = perturbed(airframe, scale)
        air = WorldSettings(FALL_WIND, float(random.uniform(-180.0, 180.0)), FALL_GUSTS, battery=1e6)
    vehicle = craft.fly(seed, Start(up=THROW_HEIGHT, airborne=True), airframe)
    return Aircraft(vehicle, STUDY_WORLD, Configuration(Settings(), vehicle.tuning, air), airborne=True)


def _followed(aircraft: Aircraft, seed: int, throw: Throw, velocity: Vector, radius: float) -> AircraftFall:
    vehicle = aircraft.vehicle
    here, began, before = vehicle.truth.body.position, vehicle.time, len(vehicle.jumps)
    vehicle.place(Body(here, velocity, throw.attitude, throw.rates))
    lowest, settled, end = here.z, 0, FallEnd.LATE
    while end is FallEnd.LATE and vehicle.time - began < MAX_RETURN_TIME:
        aircraft.advance(SAMPLE_PERIODS)
        body = vehicle.truth.body
        lowest = min(lowest, body.position.z)
        near = math.dist(body.position, (0.0, 0.0, THROW_HEIGHT)) < radius and math.hypot(*body.velocity) < HOME_SPEED
        settled = settled + 1 if near else 0
        if vehicle.law.regime is Regime.GROUND:
            end = FallEnd.CRASHED
        elif settled >= HOME_LOOKS:
            end = FallEnd.HOME
    return AircraftFall(
        seed=seed,
        velocity=velocity,
        end=end,
        lost=here.z - lowest,
        time=vehicle.time - began,
        away=math.dist(vehicle.truth.body.position, (0.0, 0.0, THROW_HEIGHT)),
        jumps=tuple(jump.name for jump in vehicle.jumps[before:]),
    )


def run(flights: int, first: int, craft: Craft, *, windy: bool, jobs: int = 1) -> list[AircraftFall]:
    """Fly seeds ``first`` to ``first + flights - 1``; their order and results do not depend on the jobs.

    Raises:
        SitlError: If there is nothing to fly, or no such seed.
    """
    return fly_draws(partial(fly, craft=craft, windy=windy), seeds(flights, first), jobs, FALLS_PER_TASK)


def count(results: Sequence[AircraftFall], end: FallEnd) -> int:
    """Number of falls that ended so."""
    return sum(result.end is end for result in results)


def aircraft_summary(results: Sequence[AircraftFall]) -> list[str]:
    """Ends of the falls, and each that did not end at home, as lines of text."""
    lost, time = ([getattr(result, name) for result in results] for name in ("lost", "time"))
    figures = [" / ".join(f"{np.quantile(values, share):.1f}" for share in (0.5, 0.95, 1.0)) for values in (lost, time)]
    lines = [
        f"{len(results)} falls from {THROW_HEIGHT:g} m, seeds {results[0].seed} to {results[-1].seed}: "
        f"{count(results, FallEnd.CRASHED)} crashed, {counted(count(results, FallEnd.HOME), len(results))} home within "
        f"{MAX_RETURN_TIME:g} s",
        f"height lost, median / 95 % / worst: {figures[0]} m; until home: {figures[1]} s",
    ]
    return lines + [
        f"{r.end}: seed {r.seed}: thrown at ({r.velocity.x:.1f}, {r.velocity.y:.1f}, {r.velocity.z:.1f}) m/s, "
        f"{r.lost:.0f} m lost, {r.away:.0f} m away after {r.time:.0f} s ({', '.join(r.jumps)})"
        for r in results
        if r.end is not FallEnd.HOME
    ]


# A page of falls: the height they need over sink rate and tumble, and the supervisor beside the law alone.


DARK = 60.0  # cells beyond this are dark [m]
PANELS = ((0.5, "median"), (0.95, "nineteen in twenty"), (1.0, "worst"))


def save_plot(results: Sequence[HeightLost], cells: Sequence[MapCell], path: Path) -> None:
    """Draw the map, and the distribution of the height lost by kind of fall.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(11.0, 7.0)
    grid = page.add_gridspec(2, len(PANELS))
    for column, (share, title) in enumerate(PANELS):
        _map(page.add_subplot(grid[0, column]), cells, share, title)
    _distributions(page.add_subplot(grid[1, :]), results)
    save_page(page, path, dpi=90)


def _map(axis: Axes, cells: Sequence[MapCell], share: float, title: str) -> None:
    needed = np.array([np.quantile(cell.lost, share) for cell in cells]).reshape(len(MAP_SINKS), len(MAP_TUMBLES))
    axis.imshow(needed, origin="lower", cmap="YlOrRd", vmin=0.0, vmax=100.0, aspect="auto")
    for row, column in np.ndindex(*needed.shape):
        axis.text(
            column,
            row,
            f"{needed[row, column]:.0f}",
            ha="center",
            va="center",
            color="white" if needed[row, column] > DARK else "black",
        )
    axis.set_xticks(range(len(MAP_TUMBLES)), [f"{tumble:g}" for tumble in MAP_TUMBLES])
    axis.set_yticks(range(len(MAP_SINKS)), [f"{sink:g}" for sink in MAP_SINKS])
    axis.set_xlabel("tumble [rad/s]")
    axis.set_ylabel("sink rate [m/s]")
    axis.set_title(f"height needed [m], {title}")


def _distributions(axis: Axes, results: Sequence[HeightLost]) -> None:
    for r in results:
        share = np.arange(1, len(r.supervisor) + 1) / len(r.supervisor)
        (line,) = axis.plot(np.sort(r.supervisor), share, label=r.kind)
        axis.plot(np.sort(r.alone), share, linestyle=":", color=line.get_color())
    axis.set_xlabel("height lost [m]; dotted: the zero-moment law alone from the same draws")
    axis.set_ylabel("share of the falls")
    axis.legend(loc="lower right", fontsize=8)
    axis.grid(alpha=0.3)


MAX_WINDY_CRASHES = 0.03  # share of the falls in wind


def study_falls(args: argparse.Namespace) -> int:
    """Fly the falls and print their figures; exit code 1 if one needs more height than it should or too many crash."""
    check_seeded(args, {}, ["draws"])
    if args.plot is not None:
        check_plot_path(args.plot)

    craft = craft_of(args)
    model = craft.model
    lost = heights(model, args.draws, args.first, craft.tuning)
    print(f"{args.draws} draws, seeds {args.first} to {args.first + args.draws - 1}; median, 95 %, worst")
    print("\n".join(summary(lost)), flush=True)
    cells = height_map(model, args.draws, args.first, craft.tuning)
    print("\nmedian / 95 % / worst")
    print("\n".join(map_lines(cells)), flush=True)
    ends = []
    for windy in (False, True):
        ends.append(run(args.flights, args.first, craft, windy=windy, jobs=args.jobs))
        air = f"wind {FALL_WIND:g} m/s, gusts {FALL_GUSTS:g} m/s" if windy else "still air"
        print(f"\nWhole vehicle, {air}:")
        print("\n".join(aircraft_summary(ends[-1])), flush=True)
    if args.json is not None:
        write_json(args.json, _rows(lost, cells, ends))
    if args.plot is not None:
        save_plot(lost, cells, args.plot)
    return 0 if passed(lost, *ends) else 1


def passed(heights: Sequence[HeightLost], calm: Sequence[AircraftFall], windy: Sequence[AircraftFall]) -> bool:
    """Whether no fall needs more height than under the law alone, all end at home, and few crash in wind."""
    caught = not any(result.worse or result.not_home for result in heights)
    return (
        caught
        and count(calm, FallEnd.HOME) == len(calm)
        and count(windy, FallEnd.CRASHED) <= MAX_WINDY_CRASHES * len(windy)
    )


def _rows(
    heights: Sequence[HeightLost], cells: Sequence[MapCell], ends: Sequence[Sequence[AircraftFall]]
) -> dict[str, object]:
    return {
        "heights": [{"kind": r.kind, "supervisor": r.supervisor.tolist(), "alone": r.alone.tolist()} for r in heights],
        "map": [{"sink": c.sink, "tumble": c.tumble, "lost": c.lost.tolist()} for c in cells],
        "calm": [fall._asdict() for fall in ends[0]],
        "windy": [fall._asdict() for fall in ends[1]],
    }
