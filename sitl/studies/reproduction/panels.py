"""Panels and rows that several experiments draw of a flight."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from protocol.dialect.vocabulary import Law
from sitl.model.airframe import Array
from sitl.studies import plot
from sitl.studies.reproduction.draw import COLOURS, Sheet, thin
from sitl.studies.reproduction.experiment import Panel, Row, judge
from sitl.studies.scenario import Scenario, Track

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def position_panel(name: str, number: str, caption: str, claim: str, seen: str, track: Track) -> Panel:
    """Position over time, the target dotted."""
    sheet = Sheet(f"{name}-position", height=2.6)
    with sheet as axes:
        plot.position(axes[0], thinned(track))
        axes[0].set_xlabel("t [s]")
    return Panel(number, caption, claim, seen, sheet.svg)


def attitude_panel(name: str, number: str, caption: str, claim: str, seen: str, track: Track) -> Panel:
    """Elevation of the nose over time."""
    sheet = Sheet(f"{name}-attitude", height=2.2)
    with sheet as axes:
        plot.attitude(axes[0], thinned(track))
        axes[0].set_xlabel("t [s]")
    return Panel(number, caption, claim, seen, sheet.svg)


def command_panel(name: str, number: str, caption: str, claim: str, seen: str, time: Array, actuator: Array) -> Panel:
    """Propellers and elevons over time."""
    sheet = Sheet(f"{name}-command", 2, height=2.0)
    with sheet as axes:
        plot.actuators((axes[0], axes[1]), *thin(time, actuator))
        axes[1].set_xlabel("t [s]")
    return Panel(number, caption, claim, seen, sheet.svg)


def thinned(track: Track) -> Track:
    """The track with no more samples than a plot shows."""
    names = ("time", "p", "v", "q", "actuator", "lyapunov", "law", "target", "energy", "guide")
    kept: dict[str, Any] = dict(zip(names, thin(*(getattr(track, name) for name in names)), strict=True))
    return replace(track, **kept)


def rows_of(place: str, track: Track, scenario: Scenario, causes: dict[str, str]) -> list[Row]:
    """The scenario's own figures, each with its verdict."""
    return [judge(place, f, causes.get(f.name, "")) for f in scenario.figures(track) if f.expected]


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
