"""One self-contained HTML page about a recorded flight."""

from __future__ import annotations

import html
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.util import find_spec
from typing import TYPE_CHECKING

from protocol.errors import ProtocolError
from protocol.flight_log.flight_series import FlightSeries, Prism
from protocol.names import law_words

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

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
    flight: FlightSeries, *, title: str, scenery: Sequence[Prism] = (), preamble: Sequence[tuple[str, str]] = ()
) -> str:
    """The page: charts that can be turned and zoomed, everything they need within the file.

    Args:
        flight: What was recorded.
        title: Its heading.
        scenery: What stands around the path.
        preamble: Rows of words that come first: what was flown, and how.

    Raises:
        MissingPlotlyError: Plotly is not installed.
    """
    require_plotly()
    from plotly.offline import get_plotlyjs  # noqa: PLC0415 - an optional dependency

    parts = [f"<h1>{html.escape(title)}</h1>", _table([*preamble, *_facts(flight)])]
    for heading, text, figure in _sections(flight, scenery):
        parts += [f"<h2>{heading}</h2><p>{text}</p>", _drawn(figure)]
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
