"""The campaign of holds in a wind wall's jet, in any arena, with a map of the errors over wind and 1-cos gusts."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sitl import Array, SitlError
from sitl.enclosure.arena_files import load_arena
from sitl.lab.campaigns.campaign_summary import Drawn
from sitl.lab.studies.spec_studies import FlownStudy, StudyOption, fly_study
from sitl.tools.plotting import blank_page, check_plot_path, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes

JET_OPTIONS = (
    StudyOption("wall", "vary.wall.grid", 30.0),
    StudyOption("bursts", "vary.gust.grid", 30.0),
    StudyOption("turbulence", "parameters.SIM_WALL_TURB", 1.0),
)
WORST = 2.0  # colours end here [m]


def study_jet(args: argparse.Namespace) -> int:
    """Fly the holds and print the map."""
    if args.plot is not None:
        check_plot_path(args.plot)
    room = load_arena(args.arena)
    if room.wall is None:
        raise SitlError(f"--arena {args.arena}: there is no wind wall")
    arena = str(Path(args.arena).resolve()) if args.arena.endswith(".toml") else args.arena
    middle = {"derived.north": room.north, "derived.west": room.west, "derived.height": room.height}
    draws = None if args.plot is None else lambda flown: save_jet_map(flown, args.plot)
    return fly_study(args, "jet", JET_OPTIONS, {"vehicle.arena": arena, **middle}, then=draws)


def save_jet_map(flown: FlownStudy, path: Path) -> None:
    """Draw the error and the greatest distance over wind and gust.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(11.0, 4.0)
    left, right = page.subplots(1, 2)
    errors, farthest = (np.array(flown.result.values(name)) for name in ("error", "farthest"))
    _map(left, flown.drawn, errors, np.median, "error, rms, median [m]")
    _map(right, flown.drawn, farthest, np.max, "farthest of all [m]")
    save_page(page, path, dpi=90)


def _map(axis: Axes, drawn: Drawn, values: Array, figure: Callable[[Array], float], title: str) -> None:
    walls, bursts = (sorted(set(drawn[name])) for name in ("wall", "gust"))
    cells = np.full((len(bursts), len(walls)), np.nan)
    for row, column in np.ndindex(*cells.shape):
        chosen = (np.array(drawn["gust"]) == bursts[row]) & (np.array(drawn["wall"]) == walls[column])
        group = values[chosen]
        kept = group[np.isfinite(group)]
        lost = len(group) - len(kept)
        if len(kept):
            cells[row, column] = figure(kept)
        text = (f"{cells[row, column]:.2f}" if len(kept) else "") + (f"\n{lost} lost" if lost else "")
        axis.text(column, row, text, ha="center", va="center")
    axis.imshow(cells, origin="lower", cmap="YlOrRd", vmin=0.0, vmax=WORST, aspect="auto")
    axis.set_xticks(range(len(walls)), [f"{wall:g}" for wall in walls])
    axis.set_yticks(range(len(bursts)), [f"{burst:g}" for burst in bursts])
    axis.set_xlabel("wind wall [m/s]")
    axis.set_ylabel("1-cos gusts [m/s]")
    axis.set_title(title)
