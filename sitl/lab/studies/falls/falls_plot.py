"""A page of falls: the height they need over sink rate and tumble, and the supervisor beside the law alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sitl.lab.studies.falls import falls
from sitl.lab.studies.falls.falls import HeightLost, MapCell
from sitl.tools.plotting import blank_page, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
    needed = np.array([np.quantile(cell.lost, share) for cell in cells]).reshape(
        len(falls.MAP_SINKS), len(falls.MAP_TUMBLES)
    )
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
    axis.set_xticks(range(len(falls.MAP_TUMBLES)), [f"{tumble:g}" for tumble in falls.MAP_TUMBLES])
    axis.set_yticks(range(len(falls.MAP_SINKS)), [f"{sink:g}" for sink in falls.MAP_SINKS])
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
