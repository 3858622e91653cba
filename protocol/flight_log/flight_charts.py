"""Charts of a recorded flight over its time, drawn by plotly."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from protocol.dialect.vocabulary import Law
from protocol.flight_log.field_expressions import Curve, between, with_gaps
from protocol.flight_log.flight_series import FlightSeries, Series
from protocol.names import law_label

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

Floats = NDArray[np.float64]
HEIGHT = 340  # of a chart [px]
LABEL_SHARE = 0.028  # of a chart's width, which an upright label takes, also of one of 500 pixels
MAX_POINTS = 4000  # of a line: more are not told apart on a screen
# Of middle luminance: each reads on white and on near-black (3:1), and neighbours differ for colour-blind readers too.
COLOURS = (
    "#0a7fc2", "#c97a00", "#00916a", "#d55e00", "#bf5f95", "#3f86ad", "#8c7f1f", "#8a70c9", "#d1495b", "#5b8c3a",
    "#e0313f", "#1d8f9b", "#9c6b43",
)  # fmt: skip
HOVER, FORWARD, TARGET = "#1d8f9b", "#8a70c9", "#bf5f95"  # as in the terminal: cyan, violet, magenta
LAW_COLOURS = {
    "LANDED": "#9c6b43", "HOVER_LINEAR": HOVER, "HOVER_ZERO_MOMENT": "#00916a", "ALIGN": "#5b8c3a",
    "TO_FORWARD": "#c97a00", "FORWARD_LINE_OF_SIGHT": "#bf5f95", "FORWARD_LINEAR": FORWARD, "TO_HOVER": "#8c7f1f",
    "FAILSAFE": "#d55e00", "HOVER_ATTITUDE": "#3f86ad", "CRASHED": "#e0313f", "INDI": "#0a7fc2", "ROBUST_PI": "#d1495b",
}  # fmt: skip
CLEAR, GRID = "rgba(0,0,0,0)", "rgba(128,128,128,0.3)"  # the page is light or dark
GREY, RED = "#808080", "#d55e00"
JUMP_LINE = {"color": GREY, "width": 1, "dash": "dot"}
JUMP_NAME = {"y": 1, "xanchor": "left", "yanchor": "top", "textangle": -90, "font": {"size": 9}, "showarrow": False}


def law_colour(law: str) -> str:
    """The colour that stands for a control law in every chart."""
    return LAW_COLOURS.get(law, GREY)


def lyapunov_chart(flight: FlightSeries) -> Figure | None:
    """The Lyapunov value of each law with its two thresholds, and the jumps."""
    if not len(flight.hybrid):
        return None
    figure, fields, times = _figure("V"), flight.hybrid.fields, flight.hybrid.times
    for name, colour in (("hover", HOVER), ("forward", FORWARD), ("attitude", COLOURS[2])):
        positive = np.where(fields[f"v_{name}"] > 0.0, fields[f"v_{name}"], np.nan)
        if np.isfinite(positive).any():
            _add(figure, times, positive, f"V {name}", colour)
    for law, colour in (("hover", HOVER), ("forward", FORWARD)):
        for edge, dash in (("enter", "dash"), ("leave", "dot")):
            _add(figure, times, fields[f"v_{law}_{edge}"], f"{law} law: {edge}", colour, dash=dash, width=1)
    figure.update_yaxes(type="log", exponentformat="power")
    _mark_jumps(figure, flight)
    return figure


def actuator_chart(flight: FlightSeries) -> Figure | None:
    """Propeller speeds and elevons with their limits; of other autopilots the servo outputs."""
    if not len(flight.actuators):
        return _servo_chart(flight.servos)
    from plotly.subplots import make_subplots  # noqa: PLC0415 - an optional dependency

    fields, times = flight.actuators.fields, flight.actuators.times
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.06)
    for k, side in enumerate(("left", "right")):
        for row, name, unit, values in (
            (1, "motor", "rad/s", fields["motor_speed"][:, k]),
            (2, "elevon", "deg", np.degrees(fields["elevon"][:, k])),
        ):
            _add(figure, times, values, f"{name} {side} [{unit}]", COLOURS[k], row=row)
    limits = (
        (1, "motor limits", fields["motor_min"], fields["motor_max"]),
        (2, "elevon limits", -np.degrees(fields["elevon_max"]), np.degrees(fields["elevon_max"])),
    )
    for row, name, low, high in limits:
        for values in (low, high):
            _add(figure, times, values, name, RED, dash="dash", width=1, row=row, legend=values is low)
    for row, bits in ((1, 0b11), (2, 0b1100)):
        _shade(figure, times, (fields["limits"].astype(int) & bits) != 0, row)
    figure.update_yaxes(title_text="propellers [rad/s]", row=1)
    figure.update_yaxes(title_text="elevons [deg]", row=2)
    figure.update_xaxes(title_text="time [s]", row=2)
    return _laid_out(figure, height=480)


def energy_chart(flight: FlightSeries) -> Figure | None:
    """Energy used in each law, as it grows."""
    if not len(flight.energy):
        return None
    figure, totals = _figure("energy [J]"), flight.energy.fields["energy_by_law"]
    grown = np.clip(np.diff(totals, axis=0, prepend=totals[:1]), 0.0, None)  # after a restart it counts from zero
    used = np.cumsum(np.nan_to_num(grown), axis=0)
    rows = np.unique(np.linspace(0, len(used) - 1, min(len(used), MAX_POINTS)).round().astype(int))
    for law in Law:
        if law < used.shape[1] and used[-1, law] > 0.0:
            figure.add_scatter(  # all at the same times: what is stacked is summed time by time
                x=flight.energy.times[rows], y=used[rows, law], name=law_label(law), stackgroup="law", mode="lines",
                line={"width": 0.5, "color": law_colour(law.name)},
            )  # fmt: skip
    return figure


def error_chart(flight: FlightSeries) -> Figure | None:
    """Chart of the distances of the estimated position from its set-point and from the true position [m]."""
    figure = _figure("distance [m]")
    if len(flight.position) and len(flight.target):
        off = _place(flight.position) - _at(flight.target.times, _place(flight.target), flight.position.times)
        _add(figure, flight.position.times, np.linalg.norm(off, axis=0), "from the set-point", TARGET)
    if len(flight.position) and len(flight.truth):
        true = flight.truth.fields["position"].T * np.array([[1.0], [1.0], [-1.0]])
        off = _place(flight.position) - _at(flight.truth.times, true, flight.position.times)
        _add(figure, flight.position.times, np.linalg.norm(off, axis=0), "estimate from truth", COLOURS[0])
    return figure if figure.data else None


def wind_chart(flight: FlightSeries) -> Figure | None:
    """The wind as estimated and as it is, north and east."""
    if not len(flight.air):
        return None
    figure, fields = _figure("wind [m/s]"), flight.air.fields
    for k, axis in enumerate(("north", "east")):
        _add(figure, flight.air.times, fields["wind_estimate"][:, k], f"estimate {axis}", COLOURS[k])
        _add(figure, flight.air.times, fields["wind_true"][:, k], f"truth {axis}", COLOURS[k], dash="dot", width=1)
    return figure


def view_chart(flight: FlightSeries, curves: Sequence[Curve]) -> Figure:
    """Curves of expressions, a plot for each unit above the next one, with the jumps."""
    from plotly.subplots import make_subplots  # noqa: PLC0415 - an optional dependency

    units = list(dict.fromkeys(curve.unit for curve in curves))
    figure = make_subplots(rows=len(units), cols=1, shared_xaxes=True, vertical_spacing=0.06)
    for k, each in enumerate(curves):
        order = np.argsort(each.times, kind="stable")
        colour, row = COLOURS[k % len(COLOURS)], units.index(each.unit) + 1
        _add(figure, each.times[order], each.values[order], each.text, colour, row=row)
    for row, unit in enumerate(units, 1):
        figure.update_yaxes(title_text=f"[{unit}]" if unit else "as expressed", row=row)
    if len(flight.hybrid):
        _mark_jumps(figure, flight)
    return _laid_out(figure, height=HEIGHT + 140 * (len(units) - 1))


def _servo_chart(servos: Series) -> Figure | None:
    if not len(servos):
        return None
    figure = _figure("output [us]")
    for k in range(1, 17):
        values = servos.fields.get(f"servo{k}_raw")
        if values is not None and np.ptp(values) > 0.0:
            _add(figure, servos.times, values, f"servo {k}", COLOURS[k % len(COLOURS)])
    return figure if figure.data else None


def _figure(y: str = "", height: int = HEIGHT) -> Figure:
    from plotly.graph_objects import Figure  # noqa: PLC0415 - an optional dependency

    figure = Figure()
    figure.update_yaxes(title_text=y)
    return _laid_out(figure, height)


def _laid_out(figure: Figure, height: int) -> Figure:
    figure.update_layout(
        height=height, margin={"l": 60, "r": 20, "t": 20, "b": 40}, template="plotly_white", hovermode="x unified",
        legend={"orientation": "h", "y": -0.22}, paper_bgcolor=CLEAR, plot_bgcolor=CLEAR, font_color=GREY,
    )  # fmt: skip
    figure.update_xaxes(gridcolor=GRID, zerolinecolor=GRID)
    figure.update_yaxes(gridcolor=GRID, zerolinecolor=GRID)
    if height == HEIGHT:
        figure.update_xaxes(title_text="time [s]")
    return figure


def _add(
    figure: Figure, times: Floats, values: Floats, name: str, colour: str, *, dash: str = "solid", width: float = 1.5,
    row: int | None = None, legend: bool = True,
) -> None:  # fmt: skip
    x, y = _thinned(*with_gaps(times, values))
    where: dict[str, Any] = {} if row is None else {"row": row, "col": 1}
    line = {"color": colour, "dash": dash, "width": width}
    x, y = x.astype(np.float32), y.astype(np.float32)  # a page is half as large
    figure.add_scatter(x=x, y=y, name=name, mode="lines", line=line, showlegend=legend, **where)


def _mark_jumps(figure: Figure, flight: FlightSeries) -> None:
    """A line at each jump, through all plots; its name beside it where that covers no other one."""
    free_from, width = -np.inf, LABEL_SHARE * float(np.ptp(flight.hybrid.times))
    lines, names = [], []
    for event in flight.events:
        if event.label and event.kind in {"jump", "alarm"}:
            at = {"xref": "x", "yref": "paper"}
            lines.append({**at, "x0": event.time, "x1": event.time, "y0": 0, "y1": 1, "line": JUMP_LINE})
            if event.time >= free_from:
                free_from = event.time + width
                names.append({**at, **JUMP_NAME, "x": event.time, "text": event.label})
    figure.update_layout(shapes=lines, annotations=names)  # at once: one by one a thousand take minutes


def _shade(figure: Figure, times: Floats, at_limit: NDArray[np.bool_], row: int) -> None:
    """Shade the times at a limit; what lies closer together than is told apart is one."""
    spans: list[list[float]] = []
    for first, last in _runs(at_limit):
        if at_limit[first]:
            begin, end = float(times[first]), float(times[min(last, len(times) - 1)])
            if spans and begin - spans[-1][1] < 0.2:
                spans[-1][1] = end
            else:
                spans.append([begin, end])
    for begin, end in spans:
        figure.add_vrect(x0=begin, x1=end, fillcolor=RED, opacity=0.15, line_width=0, row=row, col=1)


def _runs(values: NDArray[Any]) -> Iterable[tuple[int, int]]:
    """Begin and end (exclusive) of each run of equal values."""
    edges = np.flatnonzero(values[1:] != values[:-1]) + 1
    return pairwise([0, *edges.tolist(), len(values)])


def _place(series: Series) -> Floats:
    """North, east and up, shape (3, n) [m]."""
    return np.stack((series.fields["x"], series.fields["y"], -series.fields["z"]))


def _at(times: Floats, values: Floats, wanted: Floats) -> Floats:
    """Values of shape (k, n) at other times; NaN where nothing was recorded."""
    return np.stack([between(wanted, times, row) for row in values])


def _thinned(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """At most about MAX_POINTS samples: of each group of neighbours the least and the greatest."""
    if len(times) <= MAX_POINTS:
        return times, values
    size = -(-len(times) // (MAX_POINTS // 2))
    whole = len(times) // size * size
    groups = values[:whole].reshape(-1, size)
    least, greatest = (np.where(np.isnan(groups), edge, groups) for edge in (np.inf, -np.inf))
    rows = np.arange(len(groups)) * size
    kept = np.unique(np.concatenate((rows + least.argmin(axis=1), rows + greatest.argmax(axis=1), [len(times) - 1])))
    return times[kept], values[kept]
