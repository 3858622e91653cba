"""A page of trims over airspeed: straight at several climbs, turning, braking; gaps are where no trim exists."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from sitl import Actuators, Airframe, Array
from sitl.design.trim import Trim, braking_limit, trims
from sitl.design.turn import TurningTrim, turning_trim
from sitl.model.propeller import drawn_power
from sitl.tools.plotting import blank_page, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AnyTrim: TypeAlias = Trim | TurningTrim
TRIM_SPEEDS = np.linspace(0.0, 25.0, 101)  # [m/s]
TURN_SPEEDS = np.linspace(0.0, 25.0, 51)  # [m/s]
TRIM_CLIMBS = (-30.0, -15.0, 0.0, 15.0, 30.0, 45.0)  # [deg]
TURN_RATES = (0.0, 15.0, 30.0, 45.0, 60.0)  # [deg/s]
DECELERATIONS = (0.0, 0.5, 1.0, 2.0, 3.0)  # [m/s2]


def cost(a: Airframe, trim: AnyTrim) -> float:
    """Energy per metre of path, as the airframe counts it [J/m]; infinite without speed."""
    left, right = np.broadcast_to(trim.omega, 2).tolist()
    inflow = trim.speed * math.cos(trim.theta - trim.climb)
    return drawn_power(Actuators(left, right, 0.0, 0.0), inflow, a) / trim.speed if trim.speed > 0.0 else math.inf


def gaps(speeds: Array, flown: Sequence[AnyTrim]) -> str:
    """Speeds without a trim, in words: empty if one exists everywhere, "none" if nowhere, else the ranges of speed."""
    missing = np.array([not trim.exists for trim in flown])
    if missing.all():
        return "none"
    edges = np.flatnonzero(np.diff(np.concatenate(([False], missing, [False])).astype(int)))
    ranges = [f"{speeds[low]:g}-{speeds[high - 1]:g}" for low, high in edges.reshape(-1, 2)]
    return f"none at {', '.join(ranges)} m/s" if ranges else ""


def save_trims_plot(name: str, a: Airframe, path: Path) -> None:
    """Draw the trims of an airframe.

    Args:
        name: Of the parameter set, for the title.
        a: The airframe.
        path: Of the plot: .png, .svg or .pdf.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(10.0, 13.0)
    axes = page.subplots(6, 2, sharex=True)
    page.suptitle(f"Trims of {name}: straight (left), level turns (right); a gap is where the actuators cannot hold it")
    climbs = {f"{climb:+g} deg": trims(a, TRIM_SPEEDS, math.radians(climb)) for climb in TRIM_CLIMBS}
    turns = {
        f"{turn:g} deg/s": [turning_trim(a, float(v), math.radians(turn)) for v in TURN_SPEEDS] for turn in TURN_RATES
    }
    _family(axes[:5, 0], a, TRIM_SPEEDS, climbs)
    _family(axes[:5, 1], a, TURN_SPEEDS, turns)
    _braking(axes[5], a)
    for axis in axes[5]:
        axis.set_xlabel("V [m/s]")
    save_page(page, path, dpi=100)


def _family(axes: Sequence[Axes], a: Airframe, speeds: Array, family: Mapping[str, Sequence[AnyTrim]]) -> None:
    """Five plots in a column, a curve per member of the family."""
    rows: tuple[tuple[str, Callable[[AnyTrim], float]], ...] = (
        ("nose over horizon [deg]", lambda trim: math.degrees(trim.theta)),
        ("greater elevon [deg]", lambda trim: math.degrees(np.max(trim.delta))),
        ("faster motor [rad/s]", lambda trim: float(np.max(trim.omega))),
        ("elevon margin [deg]", lambda trim: math.degrees(trim.margin)),
        ("energy [J/m]", lambda trim: cost(a, trim)),
    )
    for axis, (label, of) in zip(axes, rows, strict=True):
        for curve, flown in family.items():
            values = [of(trim) if trim.exists else math.nan for trim in flown]
            axis.plot(speeds, values, linewidth=1.0, label=f"{curve}  {gaps(speeds, flown)}".strip())
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
    axes[4].set_yscale("log")
    axes[0].legend(fontsize=6.5, framealpha=0.5)


def _braking(axes: Sequence[Axes], a: Airframe) -> None:
    """The elevons that braking in level flight takes, and the braking limit of each climb."""
    for brake in DECELERATIONS:
        flown = trims(a, TRIM_SPEEDS, 0.0, -brake)
        values = [math.degrees(trim.delta) if trim.exists else math.nan for trim in flown]
        axes[0].plot(TRIM_SPEEDS, values, linewidth=1.0, label=f"{brake:g} m/s2  {gaps(TRIM_SPEEDS, flown)}".strip())
    axes[0].set_ylabel("elevon, braking level [deg]")
    for climb in TRIM_CLIMBS[1:5]:
        limit = braking_limit(a, TRIM_SPEEDS, math.radians(climb)).held
        axes[1].plot(TRIM_SPEEDS, limit, linewidth=1.0, label=f"{climb:+g} deg")
    axes[1].set_ylabel("braking limit [m/s2]")
    axes[1].set_ylim(-5.0, 10.0)
    for axis in axes:
        axis.legend(fontsize=6.5, framealpha=0.5)
        axis.grid(alpha=0.3)
