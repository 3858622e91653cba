"""The picture of hover or fly: what the wing saves over distance and wind, and where it breaks even."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from protocol.dialect.vocabulary import DecisionReason
from sitl.errors import SitlError
from sitl.model.airframe import Array
from sitl.prediction.predictor import Abilities, Leg, predict_forward, predict_hover
from sitl.studies.break_even import TURNS, Cell
from sitl.studies.break_even_flights import MAX_DISTANCE, MIN_DISTANCE, barred

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.contour import QuadContourSet

CLIMBS = (-10.0, 0.0, 10.0)
DISTANCES = np.geomspace(10.0, MAX_DISTANCE, 24)
WINDS = np.linspace(-4.0, 4.0, 13)
LEVELS = np.linspace(-100.0, 100.0, 21)  # of the saving [%]


def saving(able: Abilities, climb: float, turn: float) -> Array:
    """Share of the hover's energy that the wing saves, winds by distances [%]; NaN where it is barred."""
    saved = np.full((len(WINDS), len(DISTANCES)), np.nan)
    for row, wind in enumerate(WINDS):
        for column, distance in enumerate(DISTANCES):
            leg = Leg(float(distance), climb, float(wind), turn=turn)
            if barred(leg, able) is DecisionReason.NONE:
                hover, wing = predict_hover(leg, able), predict_forward(leg, able)
                saved[row, column] = 100.0 * (1.0 - wing.energy / hover.energy)
    return np.asarray(np.clip(saved, LEVELS[0], LEVELS[-1]))


def save_plot(able: Abilities, cells: Sequence[Cell], tried: Sequence[Cell], path: Path) -> None:
    """Draw a panel per climb and turn.

    Args:
        able: What the vehicle can do.
        cells: Break-even distances predicted.
        tried: Break-even distances flown.
        path: Of the picture: .png, .svg or .pdf.

    Raises:
        SitlError: If the file cannot be written; the message names it.
    """
    if not path.parent.is_dir():  # said before the work is done, not after
        raise SitlError(f"plot {path}: there is no folder {path.parent}")
    from matplotlib.figure import Figure  # noqa: PLC0415 - two seconds that only plots need

    page = Figure(figsize=(11.0, 6.6), layout="constrained")
    page.suptitle(f"Energy the wing saves at {able.airspeed:g} m/s, against hovering at {able.hover_speed:g} m/s")
    panels = page.subplots(len(TURNS), len(CLIMBS), sharex=True, sharey=True)
    for row, turn in enumerate(TURNS):
        for column, climb in enumerate(CLIMBS):
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
    try:
        page.savefig(path, dpi=90)
    except (OSError, ValueError) as error:
        raise SitlError(f"plot {path}: {error}") from error


def _panel(axis: Axes, saved: Array) -> QuadContourSet:
    axis.set_facecolor("lightgrey")
    drawn = axis.contourf(DISTANCES, WINDS, saved, LEVELS, cmap="RdBu")
    axis.set_xscale("log")
    axis.axvline(MIN_DISTANCE, color="grey", linewidth=0.8, linestyle=":")
    axis.set_xticks([10, 20, 50, 100, 200], ["10", "20", "50", "100", "200"])
    return drawn


def _points(axis: Axes, cells: Sequence[Cell], marks: str, label: str) -> None:
    found = [cell for cell in cells if math.isfinite(cell.distance)]
    axis.plot([c.distance for c in found], [c.tail_wind for c in found], marks, label=label)


__all__ = ["save_plot", "saving"]
