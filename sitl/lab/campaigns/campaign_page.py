"""A page about a campaign, one HTML file that opens without a network: figures, plots, worst cases."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from protocol.flight_log.flight_page import document
from sitl.lab.campaigns.campaign_run import CampaignResult
from sitl.lab.campaigns.campaign_summary import Drawn, finite, influences, worst_of
from sitl.lab.reproduction.flight_panels import SvgSheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_PLOTTED = 4000  # cases in one plot: the first ones
PLOTTED_QUANTITIES = 3  # over which a measure is drawn: those that it depends on most
HISTOGRAM_BINS = 40


def campaign_page(result: CampaignResult, drawn: Drawn, lines: Sequence[str], command: str) -> str:
    """The page.

    Args:
        result: The campaign.
        drawn: What was drawn of its cases.
        lines: The summary.
        command: That flies it.

    Raises:
        MissingMatplotlibError: matplotlib is not installed.
    """
    s = result.specification
    figures = escape("\n".join(lines))
    parts = [f"<h1>{escape(s.name)}</h1><p>{escape(s.about)}</p><pre>{figures}</pre>"]
    for name, measure in s.told.items():
        if not measure.is_judgement and len(finite(result.values(name))):
            label = f"{name} [{measure.unit}]" if measure.unit else name
            drawing = _plots(name, label, drawn, result.values(name))
            parts.append(f"<h2>{escape(label)}</h2><p><code>{escape(measure.text)}</code></p>{drawing}")
    parts += [_worst_table(result, name, command) for name in s.worst]
    return document(s.name, "".join(parts))


def _plots(name: str, label: str, drawn: Drawn, values: Sequence[float]) -> str:
    """The measure's distribution, and the measure over what it depends on."""
    over = [one.name for one in influences(drawn, values)[:PLOTTED_QUANTITIES]]
    sheet = SvgSheet(name, columns=1 + len(over), height=2.6, share=False)
    with sheet as axes:
        axes[0].hist(finite(values), bins=HISTOGRAM_BINS)
        axes[0].set_xlabel(label)
        axes[0].set_ylabel("cases")
        for axis, quantity in zip(axes[1:], over, strict=True):
            _scatter(axis, quantity, drawn[quantity], values)
    return f"<figure>{re.sub(r'<style.*?</style>', '', sheet.svg, flags=re.DOTALL)}</figure>"


def _scatter(axis: Axes, quantity: str, given: Sequence[Any], values: Sequence[float]) -> None:
    x = given[:MOST_PLOTTED]
    axis.plot(
        [str(value) for value in x] if any(isinstance(value, str) for value in x) else list(x),
        list(values[:MOST_PLOTTED]),
        linestyle="",
        marker=".",
        markersize=3.0,
        alpha=0.6,
    )
    axis.set_xlabel(quantity)
    axis.grid(alpha=0.3)


def _worst_table(result: CampaignResult, name: str, command: str) -> str:
    rows = "".join(
        f"<tr><td class='n'>{value:.5g}</td><td><code>{escape(command)} --case {number}</code></td></tr>"
        for number, value in worst_of(result, name)
    )
    return f"<h2>Worst by {escape(name.removeprefix('-'))}</h2><table>{rows}</table>"
