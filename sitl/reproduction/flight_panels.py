"""Panels and statements that several experiments make of a flight."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sitl import Law
from sitl.model.airframe import Array
from sitl.reproduction.experiment import Panel, Statement, judge
from sitl.reproduction.svg_sheet import COLOURS, SvgSheet, thin
from sitl.scenarios import flight_plot
from sitl.scenarios.scenario import Scenario, Track

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def position_panel(name: str, number: str, caption: str, claim: str, seen: str, track: Track) -> Panel:
    """Position over time, the target dotted."""
    sheet = SvgSheet(f"{name}-position", height=2.6)
    with sheet as axes:
        flight_plot.position(axes[0], thinned(track))
        axes[0].set_xlabel("t [s]")
    return Panel(number, caption, claim, seen, sheet.svg)


def attitude_panel(name: str, number: str, caption: str, claim: str, seen: str, track: Track) -> Panel:
    """Elevation of the nose over time."""
    sheet = SvgSheet(f"{name}-attitude", height=2.2)
    with sheet as axes:
        flight_plot.attitude(axes[0], thinned(track))
        axes[0].set_xlabel("t [s]")
    return Panel(number, caption, claim, seen, sheet.svg)


def command_panel(name: str, number: str, caption: str, claim: str, seen: str, time: Array, actuator: Array) -> Panel:
    """Propellers and elevons over time."""
    sheet = SvgSheet(f"{name}-command", 2, height=2.0)
    with sheet as axes:
        flight_plot.actuators((axes[0], axes[1]), *thin(time, actuator))
        axes[1].set_xlabel("t [s]")
    return Panel(number, caption, claim, seen, sheet.svg)


def thinned(track: Track) -> Track:
    """The track with no more samples than a plot shows."""
    names = ("time", "p", "v", "q", "actuator", "lyapunov", "law", "target", "energy", "guide")
    fewer: dict[str, Any] = dict(zip(names, thin(*(getattr(track, name) for name in names)), strict=True))
    return replace(track, **fewer)


def statements_of(place: str, track: Track, scenario: Scenario, causes: dict[str, str]) -> list[Statement]:
    """The scenario's own findings, each with its verdict; causes by name of the finding."""
    return [judge(place, f, causes.get(f.name, "")) for f in scenario.findings(track) if f.expected]


def jumps_over_time(axis: Axes, track: Track) -> None:
    """The law in force, and the jump count j on an axis of its own."""
    axis.step(track.time, track.law, where="post")
    used = sorted({int(law) for law in track.law})
    axis.set_yticks(used, [Law(law).name.replace("_", " ").lower() for law in used])
    axis.set_xlabel("t [s]")
    axis.grid(alpha=0.2)
    number = np.searchsorted([jump.time for jump in track.jumps], track.time, side="right")
    count = axis.twinx()
    count.step(track.time, number, where="post", linestyle="--", color=COLOURS[1])
    count.set_ylabel("jumps j (dashed)")
    count.spines.right.set_visible(True)
