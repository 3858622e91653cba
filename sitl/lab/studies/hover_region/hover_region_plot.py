"""A page of where flights of the linear hover law start, and which of them converge."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sitl.lab.studies.hover_region.hover_region import (
    DEFAULT_THRESHOLDS,
    MIN_CONVERGED_SHARE,
    REPORT_THRESHOLDS,
    LawRegion,
    threshold,
)
from sitl.lab.studies.hover_region.hover_region_flights import RegionFlights
from sitl.tools.plotting import blank_page, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def save_plot(results: list[LawRegion], path: Path) -> None:
    """Draw every start by V and outcome, the proved levels, and the thresholds.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(9.0, 7.0)
    page.suptitle("Linear hover law: where flights start, and whether they converge")
    above, below = page.subplots(2, 1, sharex=True)
    _strips(above, results, [result.flown for result in results])
    above.set_title("states that occur in flights: 17 m, 5 m/s, 90 deg, 3 rad/s at most", fontsize=9)
    _strips(below, results, [result.spread for result in results])
    below.set_title("states uniform on level sets of V", fontsize=9)
    below.set_xlabel("V of the LQR with Q = I, R = I at the start; proved level and first rise: of the law's own V")
    above.plot([], [], color="tab:green", linewidth=2.5, label="proved")  # not every law has one
    handles, labels = above.get_legend_handles_labels()
    page.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8)
    save_page(page, path, dpi=80)


def _strips(axis: Axes, results: list[LawRegion], strips: list[RegionFlights]) -> None:
    scatter = np.random.default_rng(0)
    for row, (result, flights) in enumerate(zip(results, strips, strict=True)):
        height = row + scatter.uniform(-0.3, 0.3, flights.start.size)
        for outcome, colour, name in ((True, "tab:blue", "converged"), (False, "tab:red", "lost")):
            chosen = flights.converged == outcome
            label = None if row else name
            axis.plot(flights.start[chosen], height[chosen], ".", color=colour, markersize=2.5, label=label)
        ends = np.array([row - 0.4, row + 0.4])
        if result.certificate is not None:
            axis.plot(2 * [result.certificate.level], ends, color="tab:green", linewidth=2.5)
        axis.plot(2 * [result.rise], ends, color="tab:orange", linewidth=1.5, label=None if row else "V first rises")
        leave = threshold(flights, MIN_CONVERGED_SHARE)
        if leave > 0.0:
            axis.plot(2 * [leave], ends, "k", linewidth=1.5, label=None if row else "95 % converge up to here")
    for values, style in ((DEFAULT_THRESHOLDS, "--"), (REPORT_THRESHOLDS, ":")):
        for value in values:
            pair = f"{values[0]:.0f} / {values[1]:.0f}" if value == values[0] else None
            axis.axvline(value, linestyle=style, linewidth=0.9, color="grey", label=pair)
    axis.set_xscale("log")
    axis.set_yticks(range(len(results)), [result.name for result in results], fontsize=8)
    axis.invert_yaxis()
