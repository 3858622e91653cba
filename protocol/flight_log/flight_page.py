"""One self-contained HTML page about a recorded flight: the flight in 3-D, its charts and its events."""

from __future__ import annotations

import base64
import gzip
import html
import json
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from protocol.errors import ProtocolError
from protocol.flight_log.field_expressions import Curve
from protocol.flight_log.flight_charts import (
    actuator_chart,
    energy_chart,
    error_chart,
    law_colour,
    lyapunov_chart,
    view_chart,
    wind_chart,
)
from protocol.flight_log.flight_motion import flight_motion
from protocol.flight_log.flight_series import FlightSeries, Prism
from protocol.flight_log.flown_legs import LEGS_TITLE, leg_costs, leg_name, leg_parts
from protocol.names import law_words

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

PAGE_FOLDER = Path(__file__).with_name("page")
VIEW_SCRIPTS = ("three.min.js", "flight_scene.js", "flight_view.js")  # in this order


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


def page_part(name: str) -> str:
    """A script or a style that pages are made of."""
    return (PAGE_FOLDER / name).read_text(encoding="utf-8")


def flight_page(
    flight: FlightSeries,
    *,
    title: str,
    scenery: Sequence[Prism] = (),
    preamble: Sequence[tuple[str, str]] = (),
    views: Sequence[tuple[str, Sequence[Sequence[Curve]]]] = (),
) -> str:
    """The page, with everything it needs within the file, compressed.

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
    motion = flight_motion(flight, scenery, [(law_words(law), law_colour(law)) for law in flight.laws().tolist()])
    if motion is not None:
        parts += [_heading("Path", "Coloured by the control law in force, with the jumps."), '<div id="view"></div>']
    kept = [(f"View {name}", "", view_chart(flight, chart)) for name, charts in views for chart in charts]
    sections = [*_sections(flight), *kept]
    for heading, text, _ in sections:
        parts += [_heading(heading, text), '<div class="chart"></div>']
    parts.append(_event_table(flight))
    parts += [
        "<noscript><p>The charts need JavaScript.</p></noscript>",
        _packed("plotly", get_plotlyjs() if sections else ""),
        _packed("view-scripts", "\n".join(map(page_part, VIEW_SCRIPTS)) if motion is not None else ""),
        _packed("motion", json.dumps(motion, separators=(",", ":"), allow_nan=False)),
        _packed("charts", f"[{','.join(figure.to_json() for _, _, figure in sections)}]"),
        f"<script>{page_part('flight_page.js')}</script>",
    ]
    return document(title, "".join(parts))


def document(title: str, body: str) -> str:
    """A page of its own, light or dark as the reader's system is.

    Args:
        title: Plain text.
        body: HTML.
    """
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
    head += '<link rel="icon" href="data:,">'  # a browser asks the server for one else
    head += f"<title>{html.escape(title)}</title><style>{page_part('page.css')}{page_part('flight_view.css')}</style>"
    return f"<!doctype html><html lang='en'><head>{head}</head><body>{body}</body></html>\n"


def _packed(name: str, text: str) -> str:
    """A text that the page's script takes out again."""
    packed = base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode()
    return f'<script type="application/gzip" id="{name}">{packed}</script>'


def _heading(heading: str, text: str) -> str:
    return f"<h2>{html.escape(heading)}</h2><p>{text}</p>"


def _sections(flight: FlightSeries) -> list[tuple[str, str, Figure]]:
    """Heading, explanation and figure of each chart that the flight has messages for."""
    made = (
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
    rows += [(LEGS_TITLE.capitalize(), "")] if summary.legs else []
    return rows + [
        (leg_name(leg).capitalize(), "; ".join(filter(None, (leg_costs(leg), leg_parts(leg))))) for leg in summary.legs
    ]


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
    return f'<h2>Events</h2><table class="events">{cells}</table>'
