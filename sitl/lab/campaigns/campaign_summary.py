"""Results of a campaign: intervals, worst cases, what the measures depend on, and a Parquet table of all cases."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from io import BytesIO
from typing import Any, NamedTuple

import numpy as np
from scipy.special import fdtrc
from scipy.stats import bootstrap

from sitl import Array, SitlError
from sitl.lab.campaigns.campaign_run import CampaignResult
from sitl.lab.campaigns.distributions import AIRFRAME_DRAW
from sitl.lab.campaigns.result_table import groups_of, table_lines
from sitl.lab.campaigns.specification import Specification, draw
from sitl.lab.studies.proportions import CONFIDENCE, counted

WORST_CASES = 5  # told for each measure
RESAMPLES = 999  # of the bootstrap
MOST_BOOTSTRAPPED = 5000  # values, of more of which the interval is that of the normal distribution
BOOTSTRAP_SEED = 1
RESAMPLES_AT_ONCE = 100  # resamples at once, for the memory
BINS = 10  # of a quantity, at most, for its share of the variance
LEAST_IN_BIN = 5  # cases
MOST_BY_CHANCE = 0.05  # of campaigns that name a quantity wrongly
MOST_NAMED = 5  # quantities that a measure depends on


Drawn = Mapping[str, Sequence[Any]]  # values of each quantity, by case


class Influence(NamedTuple):
    """A drawn quantity's share of a measure's variance."""

    name: str
    share: float  # first order, 0..1


def quantities(specification: Specification, numbers: Iterable[int]) -> Drawn:
    """The draws of some cases, by name; the airframe's constants as ``airframe.NAME``."""
    columns: dict[str, Any] = {}
    for case in (draw(specification, number) for number in numbers):
        constants = {f"{AIRFRAME_DRAW}.{name}": value for name, value in (case.factors | case.constants).items()}
        row = case.values | constants
        if not columns:
            words = {
                name for name, found in specification.vary.items() if any(isinstance(v, str) for v in found.values)
            }
            columns = {name: [] if name in words else array("d") for name in row}
        for name, value in row.items():
            columns[name].append(str(value) if isinstance(columns[name], list) else value)
    return columns


def has_words(specification: Specification, name: str) -> bool:
    """Whether a quantity may be a word."""
    found = specification.vary.get(name)
    return found is not None and any(isinstance(value, str) for value in found.values)


def finite(values: Sequence[float]) -> Array:
    """Those values that are."""
    found: Array = np.array(values, float)
    return np.asarray(found[np.isfinite(found)])


def mean_bounds(values: Array) -> tuple[float, float]:
    """The 95 % interval of a mean: by bootstrap (bias corrected), of very many values by the normal distribution."""
    if len(values) < 2 or np.ptp(values) == 0.0:
        return (float(values.min()), float(values.max())) if len(values) else (math.nan, math.nan)
    if len(values) > MOST_BOOTSTRAPPED:
        half = 1.96 * float(values.std(ddof=1)) / math.sqrt(len(values))
        return float(values.mean()) - half, float(values.mean()) + half
    found = bootstrap(
        (values,),
        np.mean,
        n_resamples=RESAMPLES,
        batch=RESAMPLES_AT_ONCE,
        confidence_level=CONFIDENCE,
        rng=np.random.default_rng(BOOTSTRAP_SEED),
    ).confidence_interval
    return float(found.low), float(found.high)


def influences(drawn: Drawn, values: Sequence[float]) -> list[Influence]:
    """Shares of a measure's variance that single quantities explain, the greatest first.

    First-order index: variance of the means of equally filled bins of the quantity over that of all, less
    what so many bins explain by chance (the adjusted correlation ratio). Left out is what chance alone explains as
    well once in twenty campaigns (F-test, by Bonferroni for all quantities).

    Args:
        drawn: Values of each quantity, by case.
        values: Of the measure, by case.
    """
    measured = np.array(values, float)
    is_known = np.isfinite(measured)
    known, total = measured[is_known], float(np.var(measured[is_known])) if is_known.any() else 0.0
    if total == 0.0:
        return []
    most = MOST_BY_CHANCE / max(len(drawn), 1)
    shares = {name: _explained(np.array(given)[is_known], known, total, most) for name, given in drawn.items()}
    found = [Influence(name, share) for name, share in shares.items()]
    return sorted((one for one in found if one.share > 0.0), key=lambda one: -one.share)


def _explained(given: Any, measured: Array, total: float, most: float) -> float:  # noqa: ANN401 - numbers or words
    levels, at = np.unique(given, return_inverse=True)
    count = len(measured)
    if len(levels) > BINS:
        bins = min(BINS, count // LEAST_IN_BIN)
        if bins < 2:
            return 0.0
        at = np.argsort(np.argsort(given, kind="stable")) * bins // count
    sizes = np.bincount(at)
    groups = int(np.count_nonzero(sizes))
    if groups < 2 or count <= groups:
        return 0.0
    means = np.bincount(at, measured) / np.maximum(sizes, 1)
    explained = min(float(sizes @ (means - measured.mean()) ** 2) / count / total, 1.0)
    ratio = explained / (groups - 1) * (count - groups) / max(1.0 - explained, 1e-12)
    if float(fdtrc(groups - 1, count - groups, ratio)) > most:
        return 0.0
    return max(1.0 - (1.0 - explained) * (count - 1) / (count - groups), 0.0)


def summary_lines(result: CampaignResult, drawn: Drawn, command: str) -> list[str]:
    """The campaign's figures as lines of text.

    Args:
        result: The campaign.
        drawn: What was drawn of its cases.
        command: That flies it, for the lines of its worst cases.
    """
    s, flown = result.specification, result.flown
    failed = [one for one in flown if one.error]
    seeds = f"seeds {s.seed} to {s.seed + (len(flown) - 1) // s.cells}"
    lines = [f"{s.name}: {len(flown)} cases, {seeds}" + (", ended early" if result.ended_early else "")]
    if s.table is not None:
        values = {name: np.array(result.values(name)) for name in s.measures}
        units = {name: measure.unit for name, measure in s.measures.items()}
        lines += ["", *table_lines(s.table, drawn, values, units), ""]
    lines += [f"{name}: {_judged(result, name)}" for name, measure in s.told.items() if measure.is_judgement]
    numbers = [name for name, measure in s.told.items() if not measure.is_judgement]
    if numbers:
        lines.append(f"{'':<24}{'mean (95 %)':>28}{'median':>10}{'p95':>10}{'least':>10}{'most':>10}")
        lines += [_figures(result, name) for name in numbers]
    for name in s.told:
        found = influences(drawn, result.values(name))[:MOST_NAMED]
        if found:
            shares = ", ".join(f"{one.name} {100.0 * one.share:.0f} %" for one in found if one.share >= 0.01)
            lines += [f"variance of {name}: {shares}"] if shares else []
    lines += [line for name in s.worst for line in _worst_lines(result, name, command)]
    lines += [line for name in s.require for line in _missing_lines(result, drawn, name, command)]
    lines += [f"{one.end}: {one.error}: {command} --case {one.number}" for one in failed[:WORST_CASES]]
    if len(failed) > WORST_CASES:
        lines.append(f"and {len(failed) - WORST_CASES} more with an error")
    return lines


def _judged(result: CampaignResult, name: str) -> str:
    values = finite(result.values(name))
    if not len(values):
        return "of no case is it known"
    s = result.specification
    least, rows = s.require.get(name), " in every row" if s.table is not None and s.table.rows else ""
    wanted = "" if least is None else f"; wanted: {100.0 * least:g} %{rows}"
    return counted(int(values.sum()), len(values)) + wanted


def _figures(result: CampaignResult, name: str) -> str:
    values, measure = finite(result.values(name)), result.specification.measures[name]
    head = f"{name} [{measure.unit}]" if measure.unit else name
    if not len(values):
        return f"{head:<24}{'of no case':>28}"
    low, high = mean_bounds(values)
    mean = f"{values.mean():.4g} ({low:.4g} to {high:.4g})"
    shown = (np.median(values), np.quantile(values, 0.95), values.min(), values.max())
    return f"{head:<24}{mean:>28}" + "".join(f"{value:>10.4g}" for value in shown)


def worst_of(result: CampaignResult, name: str) -> list[tuple[int, float]]:
    """Numbers and values of the worst cases of a measure, which has a minus where less is worse."""
    measure = name.removeprefix("-")
    sign = -1.0 if name.startswith("-") else 1.0
    known = [
        (one.number, value)
        for one, value in zip(result.flown, result.values(measure), strict=True)
        if math.isfinite(value)
    ]
    return sorted(known, key=lambda one: (-sign * one[1], one[0]))[:WORST_CASES]


def _worst_lines(result: CampaignResult, name: str, command: str) -> Iterator[str]:
    for number, value in worst_of(result, name):
        yield f"worst {name.removeprefix('-')} {value:.4g}: {command} --case {number}"


def _missing_lines(result: CampaignResult, drawn: Drawn, name: str, command: str) -> Iterator[str]:
    """Cases of which a judgement that is required does not hold, each with its values in the table's rows."""
    s = result.specification
    rows = (*s.table.rows, *filter(None, [s.table.across])) if s.table is not None else ()
    missed = [at for at, value in enumerate(result.values(name)) if s.measures[name].is_judgement and value == 0.0]
    for at in missed[:WORST_CASES]:
        number = result.flown[at].number
        values = [f"{row} {drawn[row][at]}" for row in rows]
        yield f"not {name}: {', '.join([f'seed {s.seed + number // s.cells}', *values])}: {command} --case {number}"
    if len(missed) > WORST_CASES:
        yield f"and {len(missed) - WORST_CASES} more not {name}"


def passed(result: CampaignResult, drawn: Drawn) -> bool:
    """Whether the means are as great as is required in every row of the table; a case without a value counts as 0.

    Args:
        result: The campaign.
        drawn: What was drawn of its cases.
    """
    s = result.specification
    groups = groups_of(s.table.rows if s.table is not None else (), drawn, len(result.flown))
    values = {name: np.nan_to_num(result.values(name)) for name in s.require}
    return all(
        float(values[name][places].sum()) >= least * len(places)
        for name, least in s.require.items()
        for places in groups.values()
    )


def require_parquet() -> None:
    """Check that a table can be written, before the work for it is done.

    Raises:
        SitlError: pyarrow is not installed.
    """
    if find_spec("pyarrow") is None:
        raise SitlError("Parquet needs pyarrow: pip install 'darko[cluster]'")


def parquet_table(result: CampaignResult, drawn: Drawn) -> bytes:
    """All cases as a Parquet file: number, seed, what was drawn, measures, end and error.

    Args:
        result: The campaign.
        drawn: What was drawn of its cases.

    Raises:
        SitlError: pyarrow is not installed.
    """
    require_parquet()
    import pyarrow as pa  # noqa: PLC0415 - an optional dependency
    from pyarrow import parquet  # noqa: PLC0415

    s, flown = result.specification, result.flown
    columns: dict[str, Any] = {"case": [one.number for one in flown]}
    columns["seed"] = [s.seed + one.number // s.cells for one in flown]
    columns |= {name: values if isinstance(values, list) else np.asarray(values) for name, values in drawn.items()}
    columns |= {name: result.values(name) for name in s.measures}
    columns |= {"end": [one.end for one in flown], "error": [one.error for one in flown]}
    out = BytesIO()
    parquet.write_table(pa.table(columns), out, compression="zstd")
    return out.getvalue()
