"""One self-contained HTML page about a recorded flight, with charts drawn by plotly."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from importlib.util import find_spec
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from protocol.dialect.vocabulary import Law
from protocol.errors import ProtocolError
from protocol.flight_log.field_expressions import Curve, between, longest_step, with_gaps
from protocol.flight_log.flight_series import FlightSeries, Prism, Series
from protocol.names import law_label, law_words

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

Floats = NDArray[np.float64]
HEIGHT = 340  # of a chart [px]
LABEL_SHARE = 0.018  # of a chart's width, which an upright label takes
MAX_POINTS = 4000  # of a line: more are not told apart on a screen
# Of middle luminance: each reads on white and on near-black (3:1), and neighbours differ for colour-blind readers too.
COLOURS = (
    "#0a7fc2", "#c97a00", "#00916a", "#d55e00", "#bf5f95", "#3f86ad", "#8c7f1f", "#8a70c9", "#d1495b", "#5b8c3a",
    "#e0313f", "#1d8f9b", "#9c6b43",
)  # fmt: skip
CLEAR, GRID = "rgba(0,0,0,0)", "rgba(128,128,128,0.3)"  # the page is light or dark
GREY, RED = "#808080", "#d55e00"


def law_colour(law: str) -> str:
    """The colour that stands for a control law in every chart."""
    names = [member.name for member in Law]
    return COLOURS[names.index(law)] if law in names else GREY


def path_chart(flight: FlightSeries, scenery: Sequence[Prism]) -> Figure | None:
    """The path in space, by law; where the truth is known, it too."""
    if not len(flight.position):
        return None
    figure = _figure(height=560)
    north, east, up = _place(flight.position)
    laws = flight.laws()
    for first, last in _pieces(laws, flight.position.times):
        part, law = slice(first, last), str(laws[first])
        _add_line(figure, east[part], north[part], up[part], law_words(law) or "path", law_colour(law), shown=law)
    if len(flight.truth):
        _, position = with_gaps(flight.truth.times, flight.truth.fields["position"])
        _add_line(figure, position[:, 1], position[:, 0], -position[:, 2], "truth", GREY, dash="dot")
    for prism in scenery:
        _add_prism(figure, prism)
    titles = {"xaxis": "east [m]", "yaxis": "north [m]", "zaxis": "up [m]"}
    axes = {axis: {"title": title, "showbackground": False, "gridcolor": GRID} for axis, title in titles.items()}
    figure.update_layout(scene={**axes, "aspectmode": "data"})
    return figure


def lyapunov_chart(flight: FlightSeries) -> Figure | None:
    """The Lyapunov value of each law with its two thresholds, and the jumps."""
    if not len(flight.hybrid):
        return None
    figure, fields, times = _figure("V"), flight.hybrid.fields, flight.hybrid.times
    for k, (name, value) in enumerate((("hover", "v_hover"), ("forward", "v_forward"), ("attitude", "v_attitude"))):
        positive = np.where(fields[value] > 0.0, fields[value], np.nan)
        if np.isfinite(positive).any():
            _add(figure, times, positive, f"V {name}", COLOURS[k])
    for k, law in enumerate(("hover", "forward")):
        for edge, dash in (("enter", "dash"), ("leave", "dot")):
            _add(figure, times, fields[f"v_{law}_{edge}"], f"{law} law: {edge}", COLOURS[k], dash=dash, width=1)
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
        _add(figure, flight.position.times, np.linalg.norm(off, axis=0), "from the set-point", COLOURS[0])
    if len(flight.position) and len(flight.truth):
        true = flight.truth.fields["position"].T * np.array([[1.0], [1.0], [-1.0]])
        off = _place(flight.position) - _at(flight.truth.times, true, flight.position.times)
        _add(figure, flight.position.times, np.linalg.norm(off, axis=0), "estimate from truth", COLOURS[1])
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
    figure.add_scatter(x=x, y=y, name=name, mode="lines", line=line, showlegend=legend, **where)


def _add_line(
    figure: Figure, east: Floats, north: Floats, up: Floats, name: str, colour: str, *, dash: str = "solid",
    shown: str = "",
) -> None:  # fmt: skip
    step = max(1, len(east) // MAX_POINTS)
    group = shown or name
    seen = any(trace.legendgroup == group for trace in figure.data)
    figure.add_scatter3d(
        x=east[::step], y=north[::step], z=up[::step], mode="lines", name=name.replace("_", " ").lower(),
        legendgroup=group, showlegend=not seen, line={"color": colour, "dash": dash, "width": 4},
    )  # fmt: skip


def _add_prism(figure: Figure, prism: Prism) -> None:
    corners = np.array([*prism.corners, prism.corners[0]])
    for height in (prism.bottom, prism.top):
        edge = np.full(len(corners), height)
        _add_line(figure, corners[:, 1], corners[:, 0], edge, prism.name, GREY, shown=f"prism {prism.name}")
    for north, east in prism.corners:
        post = np.array([prism.bottom, prism.top])
        sides = np.full(2, east), np.full(2, north)
        _add_line(figure, *sides, post, prism.name, GREY, shown=f"prism {prism.name}")
    if not prism.hollow:
        n = len(prism.corners)
        figure.add_mesh3d(
            x=np.tile(corners[:n, 1], 2), y=np.tile(corners[:n, 0], 2),
            z=np.repeat([prism.bottom, prism.top], n), alphahull=0, opacity=0.25, color=GREY, hoverinfo="skip",
        )  # fmt: skip


def _mark_jumps(figure: Figure, flight: FlightSeries) -> None:
    """A line at each jump; its name beside it where that covers no other one."""
    free_from, width = -np.inf, LABEL_SHARE * float(np.ptp(flight.hybrid.times))
    for event in flight.events:
        if event.label and event.kind in {"jump", "alarm"}:
            is_free = event.time >= free_from
            free_from = event.time + width if is_free else free_from
            figure.add_vline(
                x=event.time, line={"color": GREY, "width": 1, "dash": "dot"},
                annotation_text=event.label if is_free else "", annotation_textangle=-90, annotation_font_size=9,
            )  # fmt: skip


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


def _pieces(laws: NDArray[np.str_], times: Floats) -> Iterable[tuple[int, int]]:
    """Begin and end (exclusive) of the path's lines: of one law each, joined to the next, but not over a gap."""
    gaps = {*(np.flatnonzero(np.diff(times) > longest_step(times)) + 1).tolist(), len(laws)}
    for first, last in _runs(laws):
        edges = [first, *sorted(gap for gap in gaps if first < gap < last), last]
        yield from ((begin, end if end in gaps else end + 1) for begin, end in pairwise(edges))


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


_STYLE = """
:root{color-scheme:light dark;--ink:#222;--soft:#444;--paper:#fff;--jump:#0068a3;--mode:#00734f;--alarm:#b3261e}
@media (prefers-color-scheme:dark){:root{--ink:#e4e6e8;--soft:#b4bcc4;--paper:#14171a;--jump:#6fb6e6;--mode:#58c69c;
--alarm:#f2938c}}
body{font:15px/1.45 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:var(--ink);
background:var(--paper);overflow-wrap:anywhere}
h1{font-size:1.5em} h2{font-size:1.15em;margin:1.6em 0 .3em} p{margin:.3em 0 .6em;color:var(--soft)}
table{border-collapse:collapse;margin:.6em 0} td,th{padding:.2em .8em .2em 0;text-align:left;vertical-align:top}
td.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.jump{color:var(--jump)} .armed,.mode{color:var(--mode)} .alarm{color:var(--alarm);font-weight:600}
"""
# The charts' letters follow the page, also when it changes while it is open.
_CHART_INK = """
const dark = matchMedia("(prefers-color-scheme: dark)");
function ink() {
  for (const chart of document.querySelectorAll(".plotly-graph-div"))
    Plotly.relayout(chart, {"font.color": dark.matches ? "#e4e6e8" : "#222"});
}
dark.addEventListener("change", ink);
ink();
"""


class MissingPlotlyError(ProtocolError):
    """Plotly is not installed."""

    def __init__(self) -> None:
        super().__init__("the page needs plotly: pip install 'darko[plots]'")


def require_plotly() -> None:
    """Check that a page can be drawn, before the work for it is done.

    Raises:
        MissingPlotlyError: Plotly is not installed.
    """
    if find_spec("plotly") is None:
        raise MissingPlotlyError


def flight_page(
    flight: FlightSeries,
    *,
    title: str,
    scenery: Sequence[Prism] = (),
    preamble: Sequence[tuple[str, str]] = (),
    views: Sequence[tuple[str, Sequence[Sequence[Curve]]]] = (),
) -> str:
    """The page: charts that can be turned and zoomed, everything they need within the file.

    Args:
        flight: What was recorded.
        title: Its heading.
        scenery: What stands around the path.
        preamble: Rows of words that come first: what was flown, and how.
        views: Charts of expressions that were kept: the name of each, and the curves of its charts.

    Raises:
        MissingPlotlyError: Plotly is not installed.
    """
    require_plotly()
    from plotly.offline import get_plotlyjs  # noqa: PLC0415 - an optional dependency

    parts = [f"<h1>{html.escape(title)}</h1>", _table([*preamble, *_facts(flight)])]
    kept = [(f"View {name}", "", view_chart(flight, chart)) for name, charts in views for chart in charts]
    for heading, text, figure in [*_sections(flight, scenery), *kept]:
        parts += [f"<h2>{html.escape(heading)}</h2><p>{text}</p>", _drawn(figure)]
    parts.append(_event_table(flight))
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
    head += f"<title>{html.escape(title)}</title><style>{_STYLE}</style>"
    head += f"<script>{get_plotlyjs()}</script>"
    parts.append(f"<script>{_CHART_INK}</script>")
    return f"<!doctype html><html lang='en'><head>{head}</head><body>{''.join(parts)}</body></html>\n"


def _sections(flight: FlightSeries, scenery: Sequence[Prism]) -> list[tuple[str, str, Figure]]:
    """Heading, explanation and figure of each chart that the flight has messages for."""
    made = (
        ("Path", "The estimated path, coloured by the control law in force.", path_chart(flight, scenery)),
        (
            "Lyapunov values and jumps",
            "Dashed: a linear law is entered below this value; dotted: it is left above it. "
            "Vertical lines are jumps, each with the law it enters.",
            lyapunov_chart(flight),
        ),
        ("Actuators", "Shaded: an actuator is at a limit.", actuator_chart(flight)),
        ("Energy by law", "Since the beginning of the log.", energy_chart(flight)),
        (
            "Tracking and estimation",
            "The distance from the set-point, and of the estimate from the truth that a simulation knows.",
            error_chart(flight),
        ),
        ("Wind", "Lines: as the vehicle estimates it; dotted: as it is.", wind_chart(flight)),
    )
    return [(heading, text, figure) for heading, text, figure in made if figure is not None]


def _facts(flight: FlightSeries) -> list[tuple[str, str]]:
    summary = flight.summary
    rows = [("Recorded", f"{datetime.fromtimestamp(flight.start_usec / 1e6, UTC):%Y-%m-%d %H:%M:%S} UTC")]
    rows = rows if flight.start_usec else []
    rows.append(("Flight time on the vehicle's clock", f"{flight.duration:.1f} s"))
    if summary.distance is not None:
        rows.append(("Distance flown while armed", f"{summary.distance:.1f} m"))
    if summary.height is not None:
        rows.append(("Greatest height", f"{summary.height:.1f} m"))
    if summary.jumps:
        rows.append(("Jumps", str(len(summary.jumps))))
    rows += [(f"Under {law_words(law)}", _time_and_energy(flight, law)) for law in summary.laws]
    return rows


def _time_and_energy(flight: FlightSeries, law: str) -> str:
    energy = flight.summary.energy.get(law)
    return f"{flight.summary.laws[law]:.1f} s" + (f", {energy:.0f} J" if energy is not None else "")


def _table(rows: Sequence[tuple[str, str]]) -> str:
    cells = "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in rows)
    return f"<table>{cells}</table>"


def _event_table(flight: FlightSeries) -> str:
    cells = "".join(
        f'<tr class="{event.kind}"><td class="n">{event.time:.2f} s</td><td>{html.escape(event.text)}</td></tr>'
        for event in flight.events
    )
    return f"<h2>Events</h2><table>{cells}</table>"


def _drawn(figure: Figure) -> str:
    return str(figure.to_html(full_html=False, include_plotlyjs=False, config={"displaylogo": False}))
