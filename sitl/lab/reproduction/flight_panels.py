"""Panels that several experiments make of a flight."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sitl import Array, JumpRecord, Law
from sitl.lab import scenarios
from sitl.lab.reproduction.experiment import Panel
from sitl.lab.scenarios import Track
from sitl.tools.plotting import blank_page, require_matplotlib

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.typing import RcKeyType


# Figures as SVG whose text and axes take the colour of the page around them, for light and dark themes.


INK = "#010203"  # stands for the page's text colour
COLOURS = ("#3b82c4", "#e07b39", "#3fa66b", "#c0508f", "#8f7ad1", "#a08a2c")  # legible on white and on near-black
MAX_POINTS = 700  # per line: more than the pixels it is shown on
PLOT_STYLE: dict[RcKeyType, Any] = {
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "font.family": "sans-serif",
    "font.size": 9.0,
    "grid.color": INK,
    "legend.frameon": False,
    "path.simplify_threshold": 0.4,
    "svg.fonttype": "none",
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
}


class SvgSheet:
    """A figure of a few plots above one another, drawn in the style of the page.

    A context manager that gives matplotlib's axes; afterwards ``svg`` holds the drawing.

    Raises:
        MissingMatplotlibError: If matplotlib is not installed.
    """

    def __init__(self, name: str, rows: int = 1, *, columns: int = 1, height: float = 2.2, share: bool = True) -> None:
        require_matplotlib()
        import matplotlib as mpl  # noqa: PLC0415 - two seconds that only figures need
        from cycler import cycler  # noqa: PLC0415 - installed with matplotlib

        self._style = mpl.rc_context(PLOT_STYLE | {"axes.prop_cycle": cycler(color=COLOURS), "svg.hashsalt": name})
        self._size = (7.4, height * rows + 0.3)
        self._grid = (rows, columns, share)
        self.name, self.svg = name, ""

    def __enter__(self) -> list[Axes]:
        self._style.__enter__()
        rows, columns, share = self._grid
        self.page = blank_page(*self._size)
        grid = self.page.subplots(rows, columns, sharex=share, squeeze=False)
        return [axis for row in grid for axis in row]

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        if kind is None:
            self.svg = _inline(self.page)
        self._style.__exit__(kind, error, where)


def _inline(page: Figure) -> str:
    """The figure as a bare <svg> element: no prologue, no metadata, text and axes in the page's colour."""
    out = io.StringIO()
    page.savefig(out, format="svg", transparent=True, metadata={"Date": None})
    text = out.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r'(<svg [^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg [^>]*?) height="[^"]*"', r"\1", text, count=1))
    text = re.sub(r'<g id="[^"]*"', "<g", text)  # matplotlib counts from one in every figure
    return text.replace(INK, "currentColor")


def thin(*arrays: Array) -> tuple[Array, ...]:
    """Every n-th row of each array, so that about ``MAX_POINTS`` remain."""
    step = max(1, arrays[0].shape[0] // MAX_POINTS)
    return tuple(array[::step] for array in arrays)


PRINTED_THRESHOLDS = (250.0, 400.0)  # of section 5.1
SEQUENCE = (
    "Pitch, then yaw, then roll, about axes of the body (y, z', x''): unlike the usual ZYX this does not fold at the "
    "hover, where pitch is -90 deg, roll the heading and yaw the lean sideways; nose up is negative, as in the report."
)


class Angles(NamedTuple):
    """Attitudes as three angles, each (n,) [rad]."""

    roll: Array
    pitch: Array
    yaw: Array


def angles(q: Array) -> Angles:
    """Roll, pitch and yaw of R(q) = R_y(pitch) R_z(yaw) R_x(roll), continuous over time.

    It folds where the nose points along ±y of the world, and nowhere in a vertical plane.

    Args:
        q: Attitudes, (n, 4).
    """
    w, x, y, z = q.T
    nose_x, nose_y, nose_z = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)
    left_y, up_y = 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    return Angles(
        np.unwrap(np.arctan2(-up_y, left_y)),
        np.unwrap(np.arctan2(-nose_z, nose_x)),
        np.arcsin(np.clip(nose_y, -1.0, 1.0)),
    )


def draw_angles(axis: Axes, time: Array, q: Array, style: str = "-", suffix: str = "") -> None:
    """Roll, pitch and yaw over time, in the colours of the report's order."""
    for angle, name, colour, width in zip(angles(q), Angles._fields, COLOURS, (2.2, 1.0, 0.8), strict=False):
        axis.plot(*thin(time, np.degrees(angle)), style, color=colour, label=f"{name}{suffix}", linewidth=width)
    axis.set_ylabel("angle [deg]")
    axis.set_xlabel("t [s]")
    axis.grid(alpha=0.2)


def attitude_panel(name: str, number: str, caption: str, claim: str, seen: str, track: Track) -> Panel:
    """Roll, pitch and yaw over time."""
    sheet = SvgSheet(f"{name}-attitude", height=2.6)
    with sheet as axes:
        draw_angles(axes[0], track.time, track.q)
        axes[0].legend(ncols=3)
    return Panel(number, caption, claim, f"{seen} {SEQUENCE}", sheet.svg)


def position_panel(name: str, number: str, caption: str, claim: str, seen: str, track: Track) -> Panel:
    """Position over time, the target dotted."""
    sheet = SvgSheet(f"{name}-position", height=2.6)
    with sheet as axes:
        scenarios.position(axes[0], thinned(track))
        axes[0].set_xlabel("t [s]")
    return Panel(number, caption, claim, seen, sheet.svg)


def command_panel(name: str, number: str, caption: str, claim: str, seen: str, time: Array, actuator: Array) -> Panel:
    """Propellers and elevons over time."""
    sheet = SvgSheet(f"{name}-command", 2, height=2.0)
    time, actuator = thin(time, actuator)
    with sheet as axes:
        for axis, columns, label in ((axes[0], actuator[:, :2], "motors [rad/s]"),
                                     (axes[1], np.degrees(actuator[:, 2:]), "elevons [deg]")):  # fmt: skip
            axis.plot(time, columns[:, 0], label="left", linewidth=2.2)
            axis.plot(time, columns[:, 1], label="right", linewidth=0.9)  # thinner: mostly it is over the left one
            axis.set_ylabel(label)
            axis.grid(alpha=0.2)
        axes[0].legend()
        axes[1].set_xlabel("t [s]")
    return Panel(number, caption, claim, seen, sheet.svg)


def thinned(track: Track) -> Track:
    """The track with no more samples than a plot shows."""
    names = ("time", "p", "v", "q", "actuator", "v_hover", "law", "target", "energy", "pointing")
    fewer: dict[str, Any] = dict(zip(names, thin(*(getattr(track, name) for name in names)), strict=True))
    return replace(track, **fewer)


def lyapunov_panel(number: str, caption: str, claim: str, seen: str, name: str, track: Track, ours: Array) -> Panel:
    """V over time down to where it is zero, the printed thresholds and ours, the jumps, and where the linear law flies.

    Args:
        number: Of the figure in the report.
        caption: The report's, in English.
        claim: Of the report.
        seen: In our run.
        name: Of the sheet.
        track: The flight.
        ours: Thresholds of this flight, (2,).
    """
    sheet = SvgSheet(f"{name}-lyapunov", height=3.0)
    with sheet as axes:
        axis, small = axes[0], thinned(track)
        axis.semilogy(small.time, np.where(small.v_hover > 0.0, small.v_hover, np.nan), linewidth=1.0)
        for values, style, colour, word in (
            (PRINTED_THRESHOLDS, "--", COLOURS[1], "printed"),
            (ours, ":", "grey", "ours"),
        ):
            for value in values:
                axis.axhline(value, linestyle=style, linewidth=0.9, color=colour, label=f"{value:g}, {word}")
        for jump in track.jumps:
            axis.axvline(jump.time, linewidth=0.7, color="crimson")
        axis.fill_between(small.time, 0, 1, where=small.law == Law.HOVER_LINEAR, transform=axis.get_xaxis_transform(),
                          alpha=0.12, label="linear hover law")  # fmt: skip
        axis.set(ylabel="V", xlabel="t [s]")
        axis.legend(fontsize=7, ncols=2)
        axis.grid(alpha=0.2)
    return Panel(number, caption, claim, seen, sheet.svg)


def jumps_panel(number: str, caption: str, claim: str, seen: str, name: str, track: Track) -> Panel:
    """The law in force, and the jump count j."""
    sheet = SvgSheet(f"{name}-jumps", height=2.2)
    with sheet as axes:
        jumps_over_time(axes[0], track)
    return Panel(number, caption, claim, seen, sheet.svg)


def jumps_over_time(axis: Axes, track: Track) -> None:
    """The law in force, and the jump count j on an axis of its own."""
    axis.step(track.time, track.law, where="post")
    used = sorted({int(law) for law in track.law})
    axis.set_yticks(used, [in_words(Law(law)) for law in used])
    axis.set_xlabel("t [s]")
    axis.grid(alpha=0.2)
    number = np.searchsorted([jump.time for jump in track.jumps], track.time, side="right")
    count = axis.twinx()
    count.step(track.time, number, where="post", linestyle="--", color=COLOURS[1])
    count.set_ylabel("jumps j (dashed)")
    count.spines.right.set_visible(True)


def in_words(law: Law) -> str:
    """A law's name as text."""
    return law.name.replace("_", " ").lower()


def listed(jumps: tuple[JumpRecord, ...]) -> str:
    """Jumps as text: when, and the law then in force."""
    return ", ".join(f"{jump.time:.1f} s: {in_words(jump.target)}" for jump in jumps)
