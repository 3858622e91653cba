"""The reproduction as one HTML page without any other file."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from typing import NamedTuple

from sitl.lab.reproduction.errata import Erratum
from sitl.lab.reproduction.experiment import (
    EntryTable,
    Experiment,
    ExperimentResult,
    Illustration,
    Kind,
    Panel,
    Recomputation,
    Statement,
    Verdict,
)

DRAWINGS = (
    ("1.1 to 1.3, 2.1, 2.2, 4.1", "drawings and photographs: they show no result"),
    ("3.1, 3.6", "block diagrams of the LQI and of the hierarchical law"),
    ("3.5", "a sketch of the linear law's region of stability"),
    ("C.1", "a drawing of the vehicle's geometry, straight and arc"),
)
LIBRARIES = ("numpy", "scipy", "numba", "matplotlib")  # named on a page
PAGE_STYLE = """
:root { color-scheme: light dark; --ink: #1c2024; --soft: #5d666f; --paper: #fdfdfc; --line: #d8dce0; --tint: #f1f3f4;
  --good: #1f7a46; --slip: #8a6100; --bad: #b3261e; }
@media (prefers-color-scheme: dark) { :root { --ink: #e4e6e8; --soft: #9aa3ab; --paper: #14171a; --line: #343a40;
  --tint: #1d2125; --good: #6cc793; --slip: #e0b455; --bad: #f2938c; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem; max-width: 68rem; color: var(--ink); background: var(--paper);
  font: 16px/1.5 system-ui, sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.7rem; line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 1px solid var(--line); }
a { color: inherit; } .soft, figcaption small, td small { color: var(--soft); }
nav ol { columns: 2; column-gap: 3rem; padding-left: 1.6rem; } nav li { break-inside: avoid; }
@media (max-width: 40rem) { nav ol { columns: 1; } }
.scroll { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-size: 0.86rem; }
th, td { text-align: left; vertical-align: top; padding: 0.35rem 0.6rem; border-bottom: 1px solid var(--line);
  overflow-wrap: break-word; }
thead th { background: var(--tint); } td.n { text-align: right; white-space: nowrap; }
tr.group th { padding-top: 1rem; border-bottom: 2px solid var(--line); }
.verdict { font-weight: 600; white-space: nowrap; } .reproduced { color: var(--good); }
.differs, .open { color: var(--slip); } .unexplained { color: var(--bad); }
figure { margin: 1.5rem 0; padding: 1rem; border: 1px solid var(--line); border-radius: 6px; }
figure svg { display: block; width: 100%; height: auto; max-width: 54rem; }
figure svg * { stroke-linejoin: round; stroke-linecap: butt; } figcaption p { margin: 0.4rem 0 0; }
details { margin: 1rem 0; } summary { cursor: pointer; font-weight: 600; }
@media print { figure, tr { break-inside: avoid; } nav { display: none; } }
"""


class Wording(NamedTuple):
    """Words of a page about its source."""

    title: str
    lead: str
    source: str  # head of the column with the published numbers
    illustrated: str  # why illustrations are no verdicts


REPORT_PAGE = Wording(
    "Hybrid control of a convertible drone: the report, reproduced",
    "F. Sansou's internship report (ENAC, LAAS-CNRS, 2021): its printed numbers and statements computed from the model "
    "that flies, its experiments flown again, its figures beside what their captions claim.",
    "report",
    "the report leaves out what it depends on, mostly gains, or our own vehicle flies",
)


class Provenance(NamedTuple):
    """Versions, seed and airframes that the page was computed with."""

    version: str  # of this software
    libraries: str
    seed: int
    airframes: Sequence[tuple[str, str]]  # name, sha256 of its file


def page(
    experiments: Sequence[Experiment],
    results: Mapping[str, ExperimentResult],
    errata: Sequence[Erratum],
    provenance: Provenance,
    wording: Wording = REPORT_PAGE,
) -> str:
    """The whole page; errata and figures without a result only where there are errata.

    Args:
        experiments: Those that were run, in the document's order.
        results: By the experiment's name.
        errata: Of the report.
        provenance: What they were computed with.
        wording: About the source.
    """
    parts = [
        _head(experiments, results, wording),
        _contents(experiments, with_errata=bool(errata)),
        _verdicts(experiments, results, wording),
        _open_differences(experiments, results, wording),
        _illustrations(experiments, results, wording),
        *(_experiment(experiment, results[experiment.name], wording) for experiment in experiments),
        *((_errata(errata), _drawings()) if errata else ()),
        _provenance(provenance),
    ]
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(wording.title)}</title><style>{PAGE_STYLE}</style></head>\n<body>\n"
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
    return f"{value:.0f}" if value == round(value) and abs(value) < 1e5 else f"{value:.4g}"


def with_unit(value: float, unit: str) -> str:
    """A computed value with its unit; a word for a value that is not finite."""
    text = number(value)
    return f"{text} {unit}".strip() if math.isfinite(value) else text


def ours(statement: Statement) -> str:
    """The number of a statement, to the digits that the verdict needs."""
    return with_unit(statement.value, statement.unit)


def cause_in_words(statement: Statement) -> str:
    """Words on a statement's cause: the change made and its result; or why the difference is open or unexplained."""
    verdict, cause, texts = statement.verdict, statement.cause, []
    if verdict is Verdict.CAUSE_COMPUTED and cause is not None:
        texts.append(_recomputed(statement, cause))
    elif verdict is Verdict.OPEN and statement.open_difference is not None:
        texts.append(f"listed: found {statement.open_difference.found.text}")
    elif verdict is Verdict.UNEXPLAINED:
        texts.append("not explained" if cause is None else f"not explained by: {_recomputed(statement, cause)}")
    return ". ".join([*texts, statement.note] if statement.note else texts)


def _recomputed(statement: Statement, cause: Recomputation) -> str:
    return f"{with_unit(cause.value, statement.unit)} with: {cause.change}"


def counts(statements: Sequence[Statement]) -> str:
    """Number of statements with each verdict, as text."""
    count = Counter(statement.verdict for statement in statements)
    words = ((count[verdict], str(verdict)) for verdict in Verdict if count[verdict])
    return ", ".join(f"{n} {text if n == 1 else text.replace('differs', 'differ')}" for n, text in words)


def _all(experiments: Sequence[Experiment], results: Mapping[str, ExperimentResult]) -> list[Statement]:
    return [statement for experiment in experiments for statement in results[experiment.name].statements]


def kinds(statements: Sequence[Statement]) -> str:
    """Number of statements of each kind that agree, out of all of that kind, as text."""
    agreeing = Counter(statement.kind for statement in statements if statement.verdict is Verdict.REPRODUCED)
    count = Counter(statement.kind for statement in statements)
    return ", ".join(f"{agreeing[kind]} of {count[kind]} {kind}" for kind in Kind if count[kind])


def _head(experiments: Sequence[Experiment], results: Mapping[str, ExperimentResult], wording: Wording) -> str:
    statements = _all(experiments, results)
    illustrations = sum(len(results[experiment.name].illustrations) for experiment in experiments)
    return (
        f"<header><h1>{escape(wording.title)}</h1><p>{escape(wording.lead)}</p>"
        f"<p><strong>{len(statements)} statements: {escape(counts(statements))}.</strong> Agree: "
        f"{escape(kinds(statements))}. And {illustrations} illustrations, which are no verdicts.</p>"
        "<p class=soft>A number is <em>reproduced</em> if it lies within half a unit of the last printed "
        "digit, or in the interval that the table states. It <em>differs, cause computed</em>, if it does so once "
        "computed with the change that is named. An <em>open difference</em> is listed with its number. Anything else "
        "is <em>unexplained</em> and fails. An <em>illustration</em> has no verdict: "
        f"{escape(wording.illustrated)}.</p></header>"
    )


def _contents(experiments: Sequence[Experiment], *, with_errata: bool) -> str:
    entries = [("verdicts", "Printed number, ours, verdict"), ("open", "Open differences")]
    entries += [("illustrations", "Illustrations")]
    entries += [(experiment.name, f"{experiment.title} ({experiment.place})") for experiment in experiments]
    entries += [("errata", "Errata"), ("drawings", "Figures without a result")] if with_errata else []
    entries += [("provenance", "Provenance")]
    items = "".join(f'<li><a href="#{name}">{escape(title)}</a></li>' for name, title in entries)
    return f'<nav aria-label="Contents"><h2>Contents</h2><ol>{items}</ol></nav>'


def _table(head: Sequence[str], body: str) -> str:
    cells = "".join(f'<th scope="col">{escape(name)}</th>' for name in head)
    return f"<div class=scroll><table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table></div>"


def _group(experiment: Experiment, columns: int) -> str:
    link = f'<a href="#{experiment.name}">{escape(experiment.title)}</a>'
    return f'<tr class=group><th colspan={columns} scope="rowgroup">{link}</th></tr>'


def _verdicts(experiments: Sequence[Experiment], results: Mapping[str, ExperimentResult], wording: Wording) -> str:
    body = []
    for experiment in experiments:
        statements = results[experiment.name].statements
        body += [_group(experiment, 7), *(_statement(statement) for statement in statements)] if statements else []
    head = ("place", "what", wording.source, "accepted", "ours", "verdict", "cause")
    return f'<section id="verdicts"><h2>Printed number, ours, verdict</h2>{_table(head, "".join(body))}</section>'


def _statement(statement: Statement) -> str:
    css = str(statement.verdict).partition(" ")[0].rstrip(",")
    expected = statement.expected
    return (
        f"<tr><td>{escape(statement.place)}</td><td>{escape(statement.name)}</td><td>{escape(expected.text)}</td>"
        f"<td>{escape(expected.reading)}</td><td class=n>{escape(ours(statement))}</td>"
        f'<td class="verdict {css}">{escape(statement.verdict)}</td><td>{escape(cause_in_words(statement))}</td></tr>'
    )


def _open_differences(
    experiments: Sequence[Experiment], results: Mapping[str, ExperimentResult], wording: Wording
) -> str:
    listed = [statement for statement in _all(experiments, results) if statement.verdict is Verdict.OPEN]
    items = "".join(
        f"<li><strong>{escape(statement.place)}, {escape(statement.name)}</strong>: {wording.source} "
        f"{escape(with_unit_text(statement.expected.text, statement.unit))}, here {escape(ours(statement))}. "
        f"{escape(statement.open_difference.why_open)}</li>"
        for statement in listed
        if statement.open_difference is not None
    )
    text = f"<ol>{items}</ol>" if listed else "<p>None among these experiments.</p>"
    return f'<section id="open"><h2>Open differences: {len(listed)}</h2>{text}</section>'


def with_unit_text(text: str, unit: str) -> str:
    """A printed number with its unit."""
    return f"{text} {unit}".strip()


def _illustrations(experiments: Sequence[Experiment], results: Mapping[str, ExperimentResult], wording: Wording) -> str:
    body = []
    for experiment in experiments:
        rows = results[experiment.name].illustrations
        body += [_group(experiment, 5), *(_illustration(row) for row in rows)] if rows else []
    head = ("place", "what", wording.source, "ours", "remark")
    return (
        '<section id="illustrations"><h2>Illustrations</h2><p>Numbers without a verdict.</p>'
        f"{_table(head, ''.join(body))}</section>"
    )


def _illustration(row: Illustration) -> str:
    return (
        f"<tr><td>{escape(row.place)}</td><td>{escape(row.name)}</td><td>{escape(row.report)}</td>"
        f"<td class=n>{escape(with_unit(row.value, row.unit))}</td><td>{escape(row.text)}</td></tr>"
    )


def _experiment(experiment: Experiment, result: ExperimentResult, wording: Wording) -> str:
    panels = "".join(_panel(panel, wording.source) for panel in result.panels)
    tables = "".join(_entry_table(table) for table in result.tables)
    return (
        f'<section id="{experiment.name}"><h2>{escape(experiment.title)}</h2>'
        f"<p class=soft>{escape(wording.source.capitalize())} {escape(experiment.place)}.</p>"
        f"<p>{escape(experiment.text)}</p>{panels}{tables}"
        "</section>"
    )


def _entry_table(table: EntryTable) -> str:
    rows = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in table.rows)
    return f"<details><summary>{escape(table.title)}</summary>{_table(table.head, rows)}</details>"


def _panel(panel: Panel, source: str) -> str:
    title = f"Figure {panel.number}: {panel.caption}" if panel.number else panel.caption
    # A style inside a drawing would be the whole page's; the page has its own for all drawings.
    drawing = re.sub(r"<style.*?</style>", "", panel.svg, flags=re.DOTALL)
    svg = drawing.replace("<svg ", f'<svg role="img" aria-label="{escape(panel.caption, quote=True)}" ', 1)
    return (
        f"<figure>{svg}<figcaption><strong>{escape(title)}</strong>"
        f"<p><small>{escape(source.capitalize())}:</small> {escape(panel.claim)}</p>"
        f"<p><small>Here:</small> {escape(panel.seen)}</p>"
        "</figcaption></figure>"
    )


def _errata(errata: Sequence[Erratum]) -> str:
    rows = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in erratum)}</tr>" for erratum in errata)
    head = ("place", "printed", "corrected", "if it stays")
    return (
        '<section id="errata"><h2>Errata</h2><p>Numbers are computed with the set <code>published</code>.</p>'
        f"{_table(head, rows)}</section>"
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
