"""A page of holds in the jet: the error, and the greatest distance, over wind and gust."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sitl.lab.studies.arena_flights.jet_holds import FlownJetHold
from sitl.tools.plotting import blank_page, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
