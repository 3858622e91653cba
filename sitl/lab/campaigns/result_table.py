"""Tables of results in Markdown: a row for each combination of what was varied, columns of statistics of measures."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from sitl import Array
from sitl.lab.campaigns.distributions import BY_CHOICE, BY_GRID, Distribution
from sitl.lab.campaigns.measures import Measure
from sitl.lab.studies.proportions import counted
from sitl.tools.toml_table import TomlTable

Rows = Mapping[str, Sequence[Any]]  # values of each name, by case
STATISTICS: dict[str, Callable[[Array], float]] = {
    "median": np.median, "mean": np.mean, "least": np.min, "most": np.max, "sum": np.sum,
}  # fmt: skip
TRUE_SHARE, TRUE_COUNT = "share", "count"  # of true ones among all, a share with its interval
PERCENTILE = re.compile(r"p(\d\d?)")
NO_VALUE = "-"  # in a cell that no case has a value for


class ResultColumn(NamedTuple):
    """One column: statistics of a measure, a slash between them."""

    statistics: tuple[str, ...]
    measure: str


class ResultTable(NamedTuple):
    """A table of results."""

    rows: tuple[str, ...]  # names of what is varied; none: one row of all cases
    across: str  # name whose values are blocks of columns; empty: none
    columns: tuple[ResultColumn, ...]


def result_table_of(
    file: str, given: object, vary: Mapping[str, Distribution | str], measures: Mapping[str, Measure]
) -> ResultTable | None:
    """A table as it is written, such as ``{ rows = ["wind"], columns = ["median across"] }``; None: there is none.

    Args:
        file: What errors call the file.
        given: The table of the file.
        vary: All that is varied, and expressions of what is derived, by name.
        measures: By name.

    Raises:
        SitlError: A row does not go by grids, choices or what is derived, or a column is no statistic of a measure.
    """
    if given is None:
        return None
    table = TomlTable(file, given, "table", {"rows", "across", "columns"})
    of_words = [name for name, one in vary.items() if isinstance(one, str) or one.kind in {BY_GRID, BY_CHOICE}]
    rows = table.table("rows") if table.has("rows") else []
    if not isinstance(rows, list) or any(row not in of_words for row in rows):
        raise table.error("rows", f"must be some of {', '.join(of_words) or 'the grids and choices, of which is none'}")
    across = table.choice("across", of_words) if table.has("across") else ""
    columns = table.table("columns")
    if not isinstance(columns, list) or not columns:
        raise table.error("columns", "must be statistics of measures in brackets")
    return ResultTable(tuple(rows), across, tuple(_column(table, column, measures) for column in columns))


def _column(table: TomlTable, given: object, measures: Mapping[str, Measure]) -> ResultColumn:
    *words, measure = str(given).split()
    statistics = tuple("".join(words).split("/"))
    for name in statistics:
        if name not in {*STATISTICS, TRUE_SHARE, TRUE_COUNT} and not PERCENTILE.fullmatch(name):
            known = ", ".join((*STATISTICS, TRUE_SHARE, TRUE_COUNT, "p95"))
            raise table.error("columns", f"has {given!r}: {name!r} must be one of {known}, before a measure")
    if measure not in measures:
        raise table.error("columns", f"has {given!r}: there is no measure {measure!r}; there are {', '.join(measures)}")
    if {TRUE_SHARE, TRUE_COUNT} & set(statistics) and not measures[measure].is_judgement:
        raise table.error("columns", f"has {given!r}, but {measure} is not true or false")
    return ResultColumn(statistics, measure)


def groups_of(names: Sequence[str], drawn: Rows, count: int) -> dict[tuple[Any, ...], list[int]]:
    """Places of the cases that have the same values of some names, in the order in which these come.

    Args:
        names: Of what is varied.
        drawn: Its values, by case.
        count: Cases.
    """
    found: dict[tuple[Any, ...], list[int]] = {}
    for at in range(count):
        found.setdefault(tuple(drawn[name][at] for name in names), []).append(at)
    return found


def table_lines(table: ResultTable, drawn: Rows, values: Mapping[str, Array], units: Mapping[str, str]) -> list[str]:
    """The table in GitHub's Markdown.

    Args:
        table: What it shows.
        drawn: What was varied, by case.
        values: Of the measures, by case; NaN: none.
        units: Of the measures.
    """
    count = len(next(iter(values.values())))
    groups = groups_of(table.rows, drawn, count)
    blocks: list[Any] = list(dict.fromkeys(drawn[table.across])) if table.across else [None]
    spread = list(itertools.product(blocks, table.columns))
    head = [*table.rows, "cases", *(_head(table, block, column, units) for block, column in spread)]
    lines = [_line(head), _line(["---"] * len(head))]
    for key, places in groups.items():
        chosen = {block: [at for at in places if block is None or drawn[table.across][at] == block] for block in blocks}
        cells = [_cell(column, values[column.measure][chosen[block]]) for block, column in spread]
        lines.append(_line([*(_word(part) for part in key), str(len(places)), *cells]))
    return lines


def _line(cells: Collection[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _head(table: ResultTable, block: Any, column: ResultColumn, units: Mapping[str, str]) -> str:  # noqa: ANN401
    unit = f" [{units[column.measure]}]" if units[column.measure] else ""
    shown = "" if set(column.statistics) <= {TRUE_SHARE, TRUE_COUNT} else f", {' / '.join(column.statistics)}"
    of = f"{table.across} {_word(block)}: " if table.across else ""
    return f"{of}{column.measure}{unit}{shown}"


def _word(value: Any) -> str:  # noqa: ANN401 - a number or a word
    return value if isinstance(value, str) else f"{value:g}"


def _cell(column: ResultColumn, values: Array) -> str:
    known = values[np.isfinite(values)]
    shown = [_figure(statistic, known, len(values)) for statistic in column.statistics]
    return " / ".join(shown) if len(known) or set(column.statistics) <= {TRUE_SHARE, TRUE_COUNT} else NO_VALUE


def _figure(statistic: str, known: Array, cases: int) -> str:
    """A statistic of the values that are known; shares are of all cases, as one without a value does not hold."""
    if statistic in {TRUE_SHARE, TRUE_COUNT}:
        true = int(known.sum())
        return f"{true}/{cases}" if statistic == TRUE_COUNT else counted(true, cases) if cases else NO_VALUE
    if not len(known):
        return NO_VALUE
    share = PERCENTILE.fullmatch(statistic)
    reduce = partial(np.quantile, q=float(share[1]) / 100.0) if share else STATISTICS[statistic]
    value = float(reduce(known))
    return f"{value:.3g}" if abs(value) < 1000.0 else f"{value:.0f}"
