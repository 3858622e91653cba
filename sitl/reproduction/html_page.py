"""The reproduction as one HTML page without any other file."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from typing import NamedTuple

from sitl.reproduction.errata import ERRATA
from sitl.reproduction.experiment import Experiment, ExperimentResult, Panel, Statement, Verdict
from sitl.scenarios.scenario import Finding

DRAWINGS = (
    ("1.1 to 1.3, 2.1, 2.2, 4.1", "drawings and photographs: they show no result"),
    ("3.1, 3.6", "block diagrams of the LQI and of the hierarchical law"),
    ("3.5", "a sketch of the linear law's region of stability"),
)
PAGE_STYLE = """
:root { color-scheme: light dark; --ink: #1c2024; --soft: #5d666f; --paper: #fdfdfc; --line: #d8dce0; --tint: #f1f3f4;
  --good: #1f7a46; --slip: #8a6100; --bad: #b3261e; }
@media (prefers-color-scheme: dark) { :root { --ink: #e4e6e8; --soft: #9aa3ab; --paper: #14171a; --line: #343a40;
  --tint: #1d2125; --good: #6cc793; --slip: #e0b455; --bad: #f2938c; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem; max-width: 68rem; color: var(--ink); background: var(--paper);
  font: 16px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 1px solid var(--line); }
a { color: inherit; } .soft, figcaption small, td small { color: var(--soft); }
nav ol { columns: 2; padding-left: 1.2rem; } @media (max-width: 40rem) { nav ol { columns: 1; } }
.scroll { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-size: 0.86rem; }
th, td { text-align: left; vertical-align: top; padding: 0.35rem 0.6rem; border-bottom: 1px solid var(--line); }
thead th { background: var(--tint); } td.n { text-align: right; white-space: nowrap; }
tr.group th { padding-top: 1rem; border-bottom: 2px solid var(--line); }
.verdict { font-weight: 600; white-space: nowrap; } .reproduced { color: var(--good); }
.only-as-typed { color: var(--slip); } .differs { color: var(--bad); }
figure { margin: 1.5rem 0; padding: 1rem; border: 1px solid var(--line); border-radius: 6px; }
figure svg { display: block; width: 100%; height: auto; max-width: 54rem; }
figure svg * { stroke-linejoin: round; stroke-linecap: butt; } figcaption p { margin: 0.4rem 0 0; }
@media print { figure, tr { break-inside: avoid; } nav { display: none; } }
"""


class Provenance(NamedTuple):
    """Versions, seed and airframes that the page was computed with."""

    version: str  # of this software
    libraries: str
    seed: int
    airframes: Sequence[tuple[str, str]]  # name, sha256 of its file


def page(experiments: Sequence[Experiment], results: Mapping[str, ExperimentResult], provenance: Provenance) -> str:
    """The whole page.

    Args:
        experiments: Those that were run, in the document's order.
        results: By the experiment's name.
        provenance: What they were computed with.
    """
    parts = [
        _head(experiments, results),
        _contents(experiments),
        _verdicts(experiments, results),
        *(_experiment(experiment, results[experiment.name]) for experiment in experiments),
        _errata(),
        _drawings(),
        _provenance(provenance),
    ]
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>DarkO: the report, reproduced</title><style>{PAGE_STYLE}</style></head>\n<body>\n"
        + "\n".join(parts)
        + "\n</body></html>\n"
    )


def number(value: float) -> str:
    """A value as the table shows it."""
    if math.isnan(value):
        return "never"
    if math.isinf(value):
        return "infinite"
    if 0.0 < abs(value) < 1e-4:
        return "< 0.0001" if value > 0.0 else "> -0.0001"
    return f"{value:.0f}" if value == round(value) and abs(value) < 1e5 else f"{value:.3g}"


def ours(finding: Finding) -> str:
    """A measured value with its unit; a word for a value that is not finite."""
    text = number(finding.value)
    return f"{text} {finding.unit}".strip() if math.isfinite(finding.value) else text


def _head(experiments: Sequence[Experiment], results: Mapping[str, ExperimentResult]) -> str:
    statements = [statement for experiment in experiments for statement in results[experiment.name].statements]
    count = Counter(statement.verdict for statement in statements)
    counts = ", ".join(f"{count[verdict]} {verdict}" for verdict in Verdict if count[verdict])
    return (
        "<header><h1>Hybrid control of a convertible drone: the report, reproduced</h1>"
        "<p>Every experiment of F. Sansou's internship report (ENAC, LAAS-CNRS, 2021) flown again on the full model, "
        "every figure beside what its caption claims, every printed number beside ours.</p>"
        f"<p><strong>{sum(count.values())} statements: {escape(counts)}.</strong> <span class=soft>'Only as typed' "
        "comes out with one of the report's own slips left in; the corrected value stands beside it.</span></p>"
        "</header>"
    )


def _contents(experiments: Sequence[Experiment]) -> str:
    entries = [("verdicts", "Printed number, ours, verdict")]
    entries += [(experiment.name, f"{experiment.title} ({experiment.place})") for experiment in experiments]
    entries += [("errata", "Errata"), ("drawings", "Figures without a result"), ("provenance", "Provenance")]
    items = "".join(f'<li><a href="#{name}">{escape(title)}</a></li>' for name, title in entries)
    return f'<nav aria-label="Contents"><h2>Contents</h2><ol>{items}</ol></nav>'


def _verdicts(experiments: Sequence[Experiment], results: Mapping[str, ExperimentResult]) -> str:
    body = []
    for experiment in experiments:
        link = f'<a href="#{experiment.name}">{escape(experiment.title)}</a>'
        body.append(f'<tr class=group><th colspan=6 scope="rowgroup">{link}</th></tr>')
        body += [_statement(statement) for statement in results[experiment.name].statements]
    head = "".join(f'<th scope="col">{name}</th>' for name in ("place", "what", "report", "ours", "verdict", "cause"))
    return (
        '<section id="verdicts"><h2>Printed number, ours, verdict</h2><div class=scroll><table>'
        f"<thead><tr>{head}</tr></thead><tbody>{''.join(body)}</tbody></table></div></section>"
    )


def _statement(statement: Statement) -> str:
    finding = statement.finding
    css = str(statement.verdict).replace(" ", "-")
    cause = statement.cause if statement.is_explained else f"not explained. {statement.cause}".strip()
    return (
        f"<tr><td>{escape(statement.place)}</td><td>{escape(finding.name)}</td><td>{escape(finding.expected)}</td>"
        f'<td class=n>{escape(ours(finding))}</td><td class="verdict {css}">{escape(statement.verdict)}</td>'
        f"<td>{escape(cause)}</td></tr>"
    )


def _experiment(experiment: Experiment, result: ExperimentResult) -> str:
    panels = "".join(_panel(panel) for panel in result.panels)
    return (
        f'<section id="{experiment.name}"><h2>{escape(experiment.title)}</h2>'
        f"<p class=soft>Report {escape(experiment.place)}. Runs alone as <code>darko-sitl scenario {experiment.name}"
        f"</code>.</p><p>{escape(experiment.text)}</p>{panels}</section>"
    )


def _panel(panel: Panel) -> str:
    title = f"Figure {panel.number}: {panel.caption}" if panel.number else panel.caption
    # A style inside a drawing would be the whole page's; the page has its own for all drawings.
    drawing = re.sub(r"<style.*?</style>", "", panel.svg, flags=re.DOTALL)
    svg = drawing.replace("<svg ", f'<svg role="img" aria-label="{escape(panel.caption, quote=True)}" ', 1)
    return (
        f"<figure>{svg}<figcaption><strong>{escape(title)}</strong>"
        f"<p><small>The report:</small> {escape(panel.claim)}</p><p><small>Here:</small> {escape(panel.seen)}</p>"
        "</figcaption></figure>"
    )


def _errata() -> str:
    rows = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in erratum)}</tr>" for erratum in ERRATA)
    head = "".join(f'<th scope="col">{name}</th>' for name in ("place", "printed", "corrected", "if it stays"))
    return (
        f'<section id="errata"><h2>Errata</h2><div class=scroll><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{rows}</tbody></table></div></section>"
    )


def _drawings() -> str:
    items = "".join(f"<li>Figures {escape(which)}: {escape(why)}.</li>" for which, why in DRAWINGS)
    return f'<section id="drawings"><h2>Figures without a result</h2><ul>{items}</ul></section>'


def _provenance(made_with: Provenance) -> str:
    sets = "".join(
        f"<li>airframe <code>{escape(name)}</code>, sha256 <code>{sha}</code></li>" for name, sha in made_with.airframes
    )
    return (
        f'<section id="provenance"><h2>Provenance</h2><ul><li>darko {escape(made_with.version)}; '
        f"{escape(made_with.libraries)}</li><li>seed {made_with.seed}</li>{sets}</ul></section>"
    )
