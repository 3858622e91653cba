"""A page of a campaign: overshoot, lowest altitude and time over the wind, and where some of the flights went."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sitl.lab.studies.campaign import MIN_FLIGHT_HEIGHT, CampaignFlight, corner, fly_and_track
from sitl.tools.plotting import blank_page, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from sitl.lab.studies.craft import Craft

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
