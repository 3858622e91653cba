"""A page of where flights of the linear hover law start, and which of them come home."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sitl.errors import SitlError
from sitl.studies.region import DEFAULTS, REPORT, SHARE, Result, threshold
from sitl.studies.region_flights import Flights

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def save_plot(results: list[Result], path: Path) -> None:
    """Draw every start by V and outcome, what is proved, and the thresholds.

    Raises:
        SitlError: If the file cannot be written; the message names it.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - two seconds that only plots need

    page = Figure(figsize=(9.0, 7.0), layout="constrained")
    page.suptitle("Linear hover law: where flights start, and whether they come home")
    above, below = page.subplots(2, 1, sharex=True)
    _strips(above, results, [result.flown for result in results])
    above.set_title("states of a flight: 17 m, 5 m/s, 90 deg, 3 rad/s at most", fontsize=9)
    _strips(below, results, [result.spread for result in results])
    below.set_title("states uniform on level sets of V", fontsize=9)
    below.set_xlabel("V of the LQR with Q = I, R = I at the start; proved level and first rise: of the law's own V")
    above.plot([], [], color="tab:green", linewidth=2.5, label="proved")  # not every law has one
    handles, labels = above.get_legend_handles_labels()
    page.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8)
    try:
        page.savefig(path, dpi=80)
    except (OSError, ValueError) as error:
        raise SitlError(f"plot {path}: {error}") from error


def _strips(axis: Axes, results: list[Result], strips: list[Flights]) -> None:
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
        leave = threshold(flights, SHARE)
        if leave > 0.0:
            axis.plot(2 * [leave], ends, "k", linewidth=1.5, label=None if row else "95 % converge up to here")
    for values, style in ((DEFAULTS, "--"), (REPORT, ":")):
        for value in values:
            pair = f"{values[0]:.0f} / {values[1]:.0f}" if value == values[0] else None
            axis.axvline(value, linestyle=style, linewidth=0.9, color="grey", label=pair)
    axis.set_xscale("log")
    axis.set_yticks(range(len(results)), [result.name for result in results], fontsize=8)
    axis.invert_yaxis()
