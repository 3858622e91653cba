"""A page per flight: position, attitude, the Lyapunov value with the jumps, and the actuators."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sitl import Array, Law
from sitl.lab.scenarios.catalogue import nose_elevation
from sitl.lab.scenarios.scenario import Scenario, Track
from sitl.tools.plotting import blank_page, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def save_plot(scenario: Scenario, track: Track, path: Path) -> None:
    """Draw position, attitude, V with its thresholds and jumps, and the actuators.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(10.0, 11.0)
    axes = page.subplots(5, 1, sharex=True)
    page.suptitle(f"{scenario.title}\n{scenario.claim}", fontsize=10)
    position(axes[0], track)
    attitude(axes[1], track)
    lyapunov(axes[2], scenario, track)
    actuators((axes[3], axes[4]), track.time, track.actuator)
    axes[4].set_xlabel("t [s]")
    save_page(page, path, dpi=110)


def lines(axis: Axes, time: Array, columns: Array, labels: tuple[str, ...], unit: str) -> None:
    """One line per column of (n, k) over time, with a legend."""
    for column, label in zip(columns.T, labels, strict=True):
        axis.plot(time, column, label=label, linewidth=1.0)
    axis.set_ylabel(unit)
    axis.legend(loc="right", fontsize=8)
    axis.grid(alpha=0.3)


def actuators(axes: tuple[Axes, Axes], time: Array, actuator: Array) -> None:
    """Propeller speeds above, elevons below, of (n, 4) in rad/s and rad."""
    lines(axes[0], time, actuator[:, :2], ("left", "right"), "motors [rad/s]")
    lines(axes[1], time, np.degrees(actuator[:, 2:]), ("left", "right"), "elevons [deg]")


def position(axis: Axes, track: Track) -> None:
    """Position, the target dotted."""
    lines(axis, track.time, track.p, ("north", "west", "up"), "position [m]")
    axis.set_prop_cycle(None)
    axis.plot(track.time, track.target, linestyle=":", linewidth=1.0)


def attitude(axis: Axes, track: Track) -> None:
    """The nose's elevation: the one angle that means the same in hover and in flight."""
    axis.plot(track.time, np.degrees(nose_elevation(track)), linewidth=1.0)
    axis.set_ylabel("nose elevation [deg]")
    axis.grid(alpha=0.3)


def lyapunov(axis: Axes, scenario: Scenario, track: Track) -> None:
    """V with its thresholds, the jumps, and where the linear law flies."""
    axis.semilogy(track.time, np.maximum(track.lyapunov, 1e-6), linewidth=1.0)
    for value in (scenario.tuning.v_enter, scenario.tuning.v_leave):
        axis.axhline(value, linestyle="--", linewidth=0.8, color="grey")
    for jump in track.jumps:
        axis.axvline(jump.time, linewidth=0.8, color="tab:red")
    linear = track.law == Law.HOVER_LINEAR
    axis.fill_between(
        track.time, 0, 1, where=linear, transform=axis.get_xaxis_transform(), alpha=0.12, label="linear law"
    )
    axis.set_ylabel("V")
    axis.legend(loc="right", fontsize=8)
    axis.grid(alpha=0.3)
