"""A page of hover or fly: what forward flight saves over distance and wind, and where it breaks even."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from protocol.dialect.vocabulary import DecisionReason
from sitl import Array
from sitl.lab.studies.break_even.break_even import LEG_TURNS, BreakEven
from sitl.lab.studies.break_even.break_even_flights import MAX_DISTANCE, MIN_DISTANCE, why_not_forward
from sitl.prediction.predictor import Abilities, Leg, predict_forward, predict_hover
from sitl.tools.plotting import blank_page, check_plot_path, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.contour import QuadContourSet

PLOTTED_CLIMBS = (-10.0, 0.0, 10.0)
PLOTTED_DISTANCES = np.geomspace(10.0, MAX_DISTANCE, 24)
PLOTTED_WINDS = np.linspace(-4.0, 4.0, 13)
SAVING_LEVELS = np.linspace(-100.0, 100.0, 21)  # [%]


def saving(able: Abilities, climb: float, turn: float) -> Array:
    """Share of the hover's energy that forward flight saves, winds by distances [%]; NaN where it is barred."""
    saved = np.full((len(PLOTTED_WINDS), len(PLOTTED_DISTANCES)), np.nan)
    for row, wind in enumerate(PLOTTED_WINDS):
        for column, distance in enumerate(PLOTTED_DISTANCES):
            leg = Leg(float(distance), climb, float(wind), turn=turn)
            if why_not_forward(leg, able) is DecisionReason.NONE:
                hover, forward = predict_hover(leg, able), predict_forward(leg, able)
                saved[row, column] = 100.0 * (1.0 - forward.energy / hover.energy)
    return np.asarray(np.clip(saved, SAVING_LEVELS[0], SAVING_LEVELS[-1]))


def save_plot(able: Abilities, cells: Sequence[BreakEven], tried: Sequence[BreakEven], path: Path) -> None:
    """Draw a panel per climb and turn.

    Args:
        able: What the vehicle can do.
        cells: Break-even distances predicted.
        tried: Break-even distances flown.
        path: Of the plot: .png, .svg or .pdf.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    check_plot_path(path)
    page = blank_page(11.0, 6.6)
    page.suptitle(f"Energy forward flight at {able.airspeed:g} m/s saves against hovering at {able.hover_speed:g} m/s")
    panels = page.subplots(len(LEG_TURNS), len(PLOTTED_CLIMBS), sharex=True, sharey=True)
    for row, turn in enumerate(LEG_TURNS):
        for column, climb in enumerate(PLOTTED_CLIMBS):
            axis = panels[row, column]
            drawn = _panel(axis, saving(able, climb, turn))
            axis.set_title(f"climb {climb:+g} m, turned by {math.degrees(turn):.0f} deg", fontsize=9)
            _points(axis, [c for c in cells if (c.climb, c.turn) == (climb, turn)], "k.", "predicted")
            _points(axis, [c for c in tried if (c.climb, c.turn) == (climb, turn)], "r*", "flown")
    for axis in panels[-1]:
        axis.set_xlabel("distance [m]")
    for axis in panels[:, 0]:
        axis.set_ylabel("tail wind [m/s]")
    panels[0, 0].legend(loc="lower right", fontsize=8)
    page.colorbar(drawn, ax=panels, label="saved [%]; grey: barred", shrink=0.8)
    save_page(page, path, dpi=90)


def _panel(axis: Axes, saved: Array) -> QuadContourSet:
    axis.set_facecolor("lightgrey")
    drawn = axis.contourf(PLOTTED_DISTANCES, PLOTTED_WINDS, saved, SAVING_LEVELS, cmap="RdBu")
    axis.set_xscale("log")
    axis.axvline(MIN_DISTANCE, color="grey", linewidth=0.8, linestyle=":")
    axis.set_xticks([10, 20, 50, 100, 200], ["10", "20", "50", "100", "200"])
    return drawn


def _points(axis: Axes, cells: Sequence[BreakEven], marks: str, label: str) -> None:
    found = [cell for cell in cells if math.isfinite(cell.distance)]
    axis.plot([c.distance for c in found], [c.tail_wind for c in found], marks, label=label)
