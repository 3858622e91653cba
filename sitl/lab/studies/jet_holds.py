"""Holding a point in a wind wall's jet through the whole autopilot: how far off, over wind and 1-cos gusts."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sitl import Aircraft, DivergedError, SitlError
from sitl.enclosure.arena_files import load_arena
from sitl.lab.studies.containment import ContainmentConditions, enclosed
from sitl.lab.studies.holds import LOOK_TIME
from sitl.lab.studies.seeded_flights import (
    DEFAULT_CRAFT,
    SAMPLE_PERIODS,
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    print_progress,
    write_json,
)
from sitl.tools.plotting import blank_page, check_plot_path, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes


JET_HOLD_HEIGHT = 2.0  # in the middle of the arena [m]
JET_LEAD_IN = 15.0  # the wall blows from the start [s]
BURSTS, BURST_EVERY, JET_BURST_TIME = 4, 6.0, 2.0  # of a hold, one each so long, each so long [s]


class FlownJetHold(NamedTuple):
    """Result of one hold in the jet."""

    seed: int
    wall: float  # [m/s]
    burst: float  # [m/s]
    error: float  # root mean square distance [m]
    farthest: float  # [m]
    fault: str  # why it ended; empty if it did not


def fly_jet_hold(
    conditions: ContainmentConditions, arena: str = "voliere", craft: Craft = DEFAULT_CRAFT
) -> FlownJetHold:
    """Fly one hold in the middle of an arena."""
    room = load_arena(arena)
    if room.wall is None:
        raise SitlError(f"--arena {arena}: there is no wind wall")
    aircraft, target = enclosed(conditions, room, craft), (room.north, room.west, JET_HOLD_HEIGHT)
    aircraft.autopilot.guided.go_to(target)
    errors, fault = [], ""
    try:
        for step in range(round((JET_LEAD_IN + BURSTS * BURST_EVERY) / LOOK_TIME)):
            elapsed = step * LOOK_TIME - JET_LEAD_IN
            if conditions.burst > 0.0 and elapsed >= 0.0 and abs(elapsed % BURST_EVERY) < 0.5 * LOOK_TIME:
                aircraft.vehicle.surroundings.begin_burst(aircraft.vehicle.time, JET_BURST_TIME, conditions.burst)
            aircraft.advance(SAMPLE_PERIODS)
            if elapsed >= 0.0:
                errors.append(math.dist(aircraft.vehicle.truth.body.position, target))
            if fault := _fault(aircraft, target):
                break
    except DivergedError as error:
        fault = str(error).split(":")[0]
    if fault or not errors:
        return FlownJetHold(*conditions[:3], math.inf, math.inf, fault)
    return FlownJetHold(*conditions[:3], float(np.sqrt(np.mean(np.square(errors)))), max(errors), "")


def _fault(aircraft: Aircraft, target: tuple[float, float, float]) -> str:
    if aircraft.vehicle.crash is not None:
        return f"crashed into {aircraft.vehicle.surroundings.touched or 'the ground'}"
    if math.dist(aircraft.autopilot.reference.position, target) > 0.01:
        return "was stopped by the net's failsafe"
    return ""


def summary(holds: Sequence[FlownJetHold]) -> list[str]:
    """The holds by wind and gust, as lines of text."""
    lines = [f"{'wall':>6}{'gust':>6}{'holds':>7}{'error rms, median / worst [m]':>32}{'farthest [m]':>14}{'lost':>6}"]
    for wall, burst in sorted({(hold.wall, hold.burst) for hold in holds}):
        group = [hold for hold in holds if (hold.wall, hold.burst) == (wall, burst)]
        kept = [hold for hold in group if not hold.fault]
        figures, far = "-", "-"
        if kept:
            figures = f"{np.median([hold.error for hold in kept]):.2f} / {max(hold.error for hold in kept):.2f}"
            far = f"{max(hold.farthest for hold in kept):.2f}"
        lines.append(f"{wall:>6g}{burst:>6g}{len(group):>7}{figures:>32}{far:>14}{len(group) - len(kept):>6}")
    return lines


# A page of holds in the jet: the error, and the greatest distance, over wind and gust.


WORST = 2.0  # colours end here [m]


def save_jet_map(holds: Sequence[FlownJetHold], path: Path) -> None:
    """Draw the maps.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(11.0, 4.0)
    left, right = page.subplots(1, 2)
    _map(left, holds, lambda group: float(np.median([hold.error for hold in group])), "error, rms, median [m]")
    _map(right, holds, lambda group: max(hold.farthest for hold in group), "farthest of all [m]")
    save_page(page, path, dpi=90)


def _map(axis: Axes, holds: Sequence[FlownJetHold], figure: Callable[[list[FlownJetHold]], float], title: str) -> None:
    walls, bursts = sorted({hold.wall for hold in holds}), sorted({hold.burst for hold in holds})
    cells = np.full((len(bursts), len(walls)), np.nan)
    for row, column in np.ndindex(*cells.shape):
        group = [hold for hold in holds if (hold.burst, hold.wall) == (bursts[row], walls[column])]
        kept = [hold for hold in group if not hold.fault]
        if kept:
            cells[row, column] = figure(kept)
        lost = len(group) - len(kept)
        text = (f"{cells[row, column]:.2f}" if kept else "") + (f"\n{lost} lost" if lost else "")
        axis.text(column, row, text, ha="center", va="center")
    axis.imshow(cells, origin="lower", cmap="YlOrRd", vmin=0.0, vmax=WORST, aspect="auto")
    axis.set_xticks(range(len(walls)), [f"{wall:g}" for wall in walls])
    axis.set_yticks(range(len(bursts)), [f"{burst:g}" for burst in bursts])
    axis.set_xlabel("wind wall [m/s]")
    axis.set_ylabel("1-cos gusts [m/s]")
    axis.set_title(title)


def study_jet(args: argparse.Namespace) -> int:
    """Fly the holds and print the map."""
    check_seeded(args, {"wall": 30.0, "bursts": 30.0, "turbulence": 1.0})
    if args.plot is not None:
        check_plot_path(args.plot)

    load_arena(args.arena)
    conditions = [
        ContainmentConditions(seed, wall, burst, args.turbulence)
        for wall in args.wall
        for burst in args.bursts
        for seed in range(args.first, args.first + args.flights)
    ]
    fly = partial(fly_jet_hold, arena=args.arena, craft=craft_of(args))
    flown = fly_draws(fly, conditions, args.jobs, on_progress=partial(print_progress, of=len(conditions)))
    print("\n".join(summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [hold._asdict() for hold in flown])
    if args.plot is not None:
        save_jet_map(flown, args.plot)
    return 0
