"""A campaign's file: what is varied, what is flown and measured, and for how long; and the cases that it draws.

``draw(specification, number)`` is one case, always the same, whatever was drawn before.
"""

from __future__ import annotations

import json
import keyword
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from protocol.errors import FileError
from protocol.flight_log.field_expressions import FIELD_CONSTANTS
from sitl import Airframe, Array, SensorSet, SitlError, load_airframe, load_sensors
from sitl.enclosure.arena_files import Arena, load_arena
from sitl.lab.campaigns.distributions import (
    AIRFRAME_DRAW,
    BY_GRID,
    DISTRIBUTION_KEYS,
    AirframeDraw,
    Distribution,
    airframe_draw_of,
    distribution_of,
)
from sitl.lab.campaigns.flight_table import FlightTable, TableReader, flight_table
from sitl.lab.campaigns.measures import FLIGHT_FACTS, MEASURE_FUNCTIONS, Measure, check_conditions, check_measures
from sitl.lab.campaigns.number_expressions import TIME_NAME, ExpressionError, NumberWalker, Value
from sitl.lab.campaigns.result_table import ResultTable, result_table_of
from sitl.lab.studies.wrong_models import perturbed
from sitl.tools.toml_table import TomlTable, toml_content

SPECIFICATION_KEYS = {
    "about", "run", "vary", "derived", "vehicle", "parameters", "start", "flight", "order", "series", "measures",
    "table", "require",
}  # fmt: skip
RUN_KEYS = {"cases", "seed", "stream", "chunk", "sampling", "block", "until", "worst"}
UNTOLD = "_"  # begins the names of measures that serve others alone
RANDOM, HYPERCUBE = "random", "latin-hypercube"
MOST_CASES, MOST_IN_CHUNK = 10_000_000, 10_000
USUAL_CHUNK, USUAL_BLOCK = 8, 64
LEAST_CASES = 20  # before a campaign may end early


class CampaignError(SitlError):
    """A campaign cannot be flown as it is written; the message names file, key and value."""


class EarlyEnd(NamedTuple):
    """A measure whose 95 % interval ends the campaign once it is narrow."""

    measure: str
    width: float  # of the share, or of the mean in the measure's unit
    least: int  # cases before that


class CampaignFiles(NamedTuple):
    """Content of the files that a specification names."""

    airframe: Airframe
    sensors: SensorSet
    arena: Arena


class Specification(NamedTuple):
    """A campaign."""

    name: str
    about: str
    cases: int  # at most
    seed: int  # of the first case
    stream: tuple[Value, ...]  # numbers beside the seed that the generator begins with, of the grid's values
    chunk: int  # cases that are flown and kept together
    sampling: str  # RANDOM or HYPERCUBE
    block: int  # cases of one hypercube
    early_end: EarlyEnd | None
    worst: tuple[str, ...]  # measures whose greatest cases are told; with a minus, the least
    vary: dict[str, Distribution]
    derived: dict[str, str]  # names of expressions of what is varied, each of those before it
    airframe_draw: AirframeDraw | None
    order: tuple[str, ...]  # in which everything is drawn
    flight: FlightTable
    files: CampaignFiles
    series: dict[str, str]
    measures: dict[str, Measure]
    table: ResultTable | None
    require: dict[str, float]  # least mean of a measure, which is a judgement's share, in every row of the table
    identity: str  # text that tells the cases from those of any other campaign

    @property
    def texts(self) -> list[str]:
        """Expressions of what is measured."""
        return [*self.series.values(), *(measure.text for measure in self.measures.values())]

    @property
    def told(self) -> dict[str, Measure]:
        """Measures that do not only serve others."""
        return {name: measure for name, measure in self.measures.items() if not name.startswith(UNTOLD)}

    @property
    def grid(self) -> dict[str, tuple[Value, ...]]:
        """The values of what is varied by a grid of its own."""
        return {name: found.values for name, found in self.vary.items() if found.kind == BY_GRID and not found.along}

    @property
    def cells(self) -> int:
        """Combinations of the grid: so many cases have the same seed."""
        return int(np.prod([len(values) for values in self.grid.values()], dtype=int))

    @property
    def chunks(self) -> list[range]:
        """Numbers of the cases of each chunk."""
        return [range(i, min(i + self.chunk, self.cases)) for i in range(0, self.cases, self.chunk)]


class Case(NamedTuple):
    """One case as it was drawn."""

    number: int
    seed: int  # of gusts and instruments
    values: dict[str, Value]  # by name, in the order of the file; what is derived comes last
    factors: dict[str, float]  # of the airframe's constants
    constants: dict[str, float]  # of the airframe, in place of its own [SI]

    def airframe(self, model: Airframe) -> Airframe:
        """An airframe as this case has it."""
        changes: dict[str, Any] = dict(self.constants)
        return perturbed(model, self.factors)._replace(**changes)


def draw(specification: Specification, number: int) -> Case:
    """A case by its number, from 0 on; there are as many as anybody asks for.

    Raises:
        SitlError: The number is negative.
    """
    s = specification
    if number < 0:
        raise SitlError(f"case {number}: cases are numbered from 0 on")
    index, cell = divmod(number, s.cells)
    values = _grid_values(s, cell)
    seed = s.seed + index
    random = _generator(seed, [NumberWalker(values).number(str(more)) for more in s.stream])
    shares = _shares(s, index) if s.sampling == HYPERCUBE else []
    factors: dict[str, float] = {}
    constants: dict[str, float] = {}
    for name in s.order:
        if name == AIRFRAME_DRAW and s.airframe_draw is not None:
            size = s.airframe_draw.size
            factors, constants = s.airframe_draw.at(shares[:size]) if shares else s.airframe_draw.drawn(random)
            shares = shares[size:]
        elif name not in values:
            stream = s.vary[name].stream
            own = random if stream is None else _generator(seed, [stream])
            values[name] = s.vary[name].at(shares[0]) if shares else s.vary[name].drawn(own)
            shares = shares[1:]
    drawn = {name: values[name] for name in s.vary}
    for name, text in s.derived.items():
        drawn[name] = NumberWalker(drawn | {"seed": float(seed)}).number(text)
    return Case(number, seed, drawn, factors, constants)


def _grid_values(s: Specification, cell: int) -> dict[str, Value]:
    """The values of grids in one combination, the last grid of the file changing soonest."""
    places: dict[str, int] = {}
    for name, given in reversed(s.grid.items()):
        cell, places[name] = divmod(cell, len(given))
    found = {name: one for name, one in s.vary.items() if one.kind == BY_GRID}
    return {name: one.values[places[one.along or name]] for name, one in found.items()}


def _generator(seed: int, stream: Sequence[float]) -> np.random.Generator:
    return np.random.default_rng((seed, *map(round, stream)) if stream else seed)


def _shares(s: Specification, index: int) -> list[float]:
    """Shares of the probability of all that a hypercube draws of a case."""
    block, row = divmod(index, s.block)
    size = sum(found.kind != BY_GRID for found in s.vary.values()) + (s.airframe_draw.size if s.airframe_draw else 0)
    return [float(share) for share in _hypercube(size, s.block, s.seed, block)[row]]


@lru_cache(maxsize=8)
def _hypercube(size: int, rows: int, seed: int, block: int) -> Array:
    """One Latin hypercube, (rows, size): of each column, one value is in each of as many equal parts of 0..1."""
    random = np.random.default_rng((seed, block))
    return np.asarray(qmc.LatinHypercube(max(size, 1), rng=random).random(rows))


def shipped_campaigns() -> list[str]:
    """Names of the specifications that are shipped."""
    folder = files("sitl.lab.campaigns") / "specs"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def load_specification(name_or_path: str, changes: Mapping[str, Any] | None = None) -> Specification:
    """Read a campaign, shipped or of a file; files that it names stand beside it.

    Args:
        name_or_path: Name of a shipped one, or a path that ends in .toml.
        changes: Values in place of the file's, by place, such as ``run.cases``.

    Raises:
        SitlError: The file cannot be read, or something in it is missing, unknown or out of bounds.
    """
    path = _path(name_or_path)
    return specification_of(path, toml_content(path, CampaignError), changes or {})


def _path(name_or_path: str) -> Path:
    path = Path(name_or_path)
    if path.suffix != ".toml":
        if name_or_path not in shipped_campaigns():
            shipped = ", ".join(shipped_campaigns())
            raise CampaignError(f"there is no campaign {name_or_path!r}; there are {shipped}, and files (.toml)")
        path = Path(str(files("sitl.lab.campaigns") / "specs" / f"{name_or_path}.toml"))
    return path


def shipped_values(name: str) -> dict[str, Any]:
    """Tables of a shipped campaign's file, with those of its base."""
    path = _path(name)
    return _with_base(path, toml_content(path, CampaignError))


def _with_base(path: Path, content: Mapping[str, Any]) -> dict[str, Any]:
    """Content of a file, and what its base, which is shipped, has besides."""
    own = dict(content)
    base = own.pop("base", None)
    if base is None:
        return own
    if base not in shipped_campaigns() or base == path.stem:
        raise CampaignError(f"{path}: base = {base!r} must be another of {', '.join(shipped_campaigns())}")
    below = _path(base)
    return _over(_with_base(below, toml_content(below, CampaignError)), own)


def _over(below: dict[str, Any], content: Mapping[str, Any]) -> dict[str, Any]:
    """Tables over others of the same names: a key that both have is the file's."""
    tables = {key for key, value in content.items() if isinstance(value, dict) and isinstance(below.get(key), dict)}
    return {**below, **content, **{key: {**below[key], **content[key]} for key in tables}}


def specification_of(path: Path, content: dict[str, Any], changes: Mapping[str, Any]) -> Specification:
    """A campaign of what was read.

    Args:
        path: Of the file.
        content: Its tables.
        changes: Values in place of these, by place, such as ``run.cases``.

    Raises:
        SitlError: Something is missing, unknown or out of bounds.
    """
    content = _changed(path, _with_base(path, content), changes)
    table = TomlTable(str(path), content, "", SPECIFICATION_KEYS, CampaignError)
    vary, airframe_draw = _varied(path, content.get("vary", {}))
    run = TomlTable(str(path), content.get("run", {}), "run", RUN_KEYS, CampaignError)
    try:
        derived = _texts(path, content.get("derived", {}), "derived", numbers=True)
        flight = flight_table(_reader(path, vary, derived), content)
        series = _texts(path, content.get("series", {}), "series")
        measures = _measures(path, content.get("measures", {}))
        names = dict.fromkeys(order.name for order in flight.orders if order.name)
        _check_names(table, vary, derived, series, measures, names)
        opened = _files(path, flight)
        check_measures(measures, series, (*vary, *derived, *names), opened.airframe)
        check_conditions(flight.conditions, series, (*vary, *derived))
        stream = _stream(run, vary)
    except ExpressionError as error:
        raise CampaignError(f"{path}: {error}") from None
    sampling = run.choice("sampling", [RANDOM, HYPERCUBE]) if run.has("sampling") else RANDOM
    block = _whole(run, "block", 2, 100_000, USUAL_BLOCK)
    seed = _whole(run, "seed", 0, 2**31 - 1, 1)
    chunk = _whole(run, "chunk", 1, MOST_IN_CHUNK, USUAL_CHUNK)
    flown = {key: content.get(key) for key in ("vary", "vehicle", "parameters", "start", "flight", "order")}
    told = [flown, content.get("series"), content.get("measures"), seed, sampling, block if sampling != RANDOM else 0]
    told += [stream] if stream else []
    told += [derived] if derived else []
    return Specification(
        name=path.stem,
        about=table.text("about") if table.has("about") else "",
        cases=_whole(run, "cases", 1, MOST_CASES, None),
        seed=seed,
        stream=stream,
        chunk=chunk,
        sampling=sampling,
        block=block,
        early_end=_early_end(path, run, measures),
        worst=_worst(run, measures),
        vary=vary,
        derived=derived,
        airframe_draw=airframe_draw,
        order=tuple(content.get("vary", {})),
        flight=flight,
        files=opened,
        series=series,
        measures=measures,
        table=result_table_of(str(path), content["table"], {**vary, **derived}, measures)
        if "table" in content
        else None,
        require=_required(path, content.get("require", {}), measures),
        identity=json.dumps(told, default=str) + repr(opened),
    )


def _changed(path: Path, content: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Content of a file with values in place of others, each by its place in it."""
    changed = dict(content)
    for place, value in changes.items():
        *tables, key = place.split(".")
        inner = changed
        for name in tables:
            if not isinstance(inner.setdefault(name, {}), dict):
                raise CampaignError(f"{path}: {place} cannot be set: {name} is no table")
            inner[name] = inner = dict(inner[name])
        inner[key] = value
    return changed


def _reader(path: Path, vary: Mapping[str, Distribution], derived: Mapping[str, str]) -> TableReader:
    """Reads numbers that may name what is varied or derived."""
    known: dict[str, tuple[Value, ...]] = {name: one.values for name, one in vary.items()}
    table = TomlTable(str(path), dict(derived), "derived", set(derived), CampaignError)
    for name, text in derived.items():
        TableReader(str(path), known).number(table, name, text)
        known[name] = (0.0,)
    return TableReader(str(path), known)


def _stream(run: TomlTable, vary: Mapping[str, Distribution]) -> tuple[Value, ...]:
    """Numbers beside the seed, of what is varied by grids alone."""
    given = run.table("stream") if run.has("stream") else []
    reader = TableReader("", {name: one.values for name, one in vary.items() if one.kind == BY_GRID})
    if not isinstance(given, list):
        raise run.error("stream", "must be numbers in brackets")
    return tuple(reader.number(run, "stream", value) for value in given)


def _whole(table: TomlTable, key: str, low: int, high: int, default: int | None) -> int:
    value = table.number(key, low, high, default)
    if value != int(value):
        raise table.error(key, f"= {value:g} is not a whole number")
    return int(value)


def _varied(path: Path, given: Any) -> tuple[dict[str, Distribution], AirframeDraw | None]:  # noqa: ANN401 - of a file
    TomlTable(str(path), given, "vary", set(given) if isinstance(given, dict) else set(), CampaignError)
    vary, airframe_draw = {}, None
    for name, value in given.items():
        known = {"relative", "of", "intervals"} if name == AIRFRAME_DRAW else DISTRIBUTION_KEYS
        table = TomlTable(str(path), value, f"vary.{name}", known, CampaignError)
        if name == AIRFRAME_DRAW:
            airframe_draw = airframe_draw_of(table, value, Airframe._fields)
        else:
            vary[name] = distribution_of(table, value)
    for name, found in vary.items():
        grid = vary.get(found.along, found)
        if found.along and (grid.kind != BY_GRID or grid.along or len(grid.values) != len(found.values)):
            flaw = f"= {found.along!r} must be a grid of {len(found.values)} values"
            raise CampaignError(f"{path}: vary.{name}.along {flaw}")
    return vary, airframe_draw


def _texts(path: Path, given: Any, where: str, *, numbers: bool = False) -> dict[str, str]:  # noqa: ANN401 - of a file
    """Expressions by their names; where numbers may stand, too, they are theirs."""
    table = TomlTable(str(path), given, where, set(given) if isinstance(given, dict) else set(), CampaignError)
    is_number = {name: numbers and isinstance(value, int | float) for name, value in given.items()}
    return {name: repr(table.number(name, -1e9, 1e9)) if is_number[name] else table.text(name) for name in given}


def _measures(path: Path, given: Any) -> dict[str, Measure]:  # noqa: ANN401 - of the file
    table = TomlTable(str(path), given, "measures", set(given) if isinstance(given, dict) else set(), CampaignError)
    if not given:
        raise table.error("", "are missing: there is nothing to measure")
    found = {}
    for name, value in given.items():
        if isinstance(value, dict):
            inner = TomlTable(str(path), value, f"measures.{name}", {"of", "unit"}, CampaignError)
            found[name] = Measure(inner.text("of"), inner.text("unit") if inner.has("unit") else "")
        else:
            found[name] = Measure(table.text(name))
    return found


def _check_names(table: TomlTable, *groups: Mapping[str, Any]) -> None:
    """Refuse names that an expression could not have, or that two things have."""
    taken = {*FLIGHT_FACTS, *MEASURE_FUNCTIONS, *FIELD_CONSTANTS, "CASE", "SERIES", "after", "where", "regime"}
    taken.add(TIME_NAME)
    for name in (name for group in groups for name in group):
        if not name.isidentifier() or keyword.iskeyword(name):
            raise table.error(name, "is not a name that an expression can have")
        if name in taken:
            raise table.error(name, "is the name of something else")
        taken.add(name)


def _files(path: Path, flight: FlightTable) -> CampaignFiles:
    def beside(name: str) -> str:
        return str(path.parent / name) if name.endswith(".toml") else name

    vehicle = flight.vehicle
    sensors = None if vehicle.sensors is None else beside(vehicle.sensors)
    try:
        return CampaignFiles(
            load_airframe(beside(vehicle.airframe)).parameters, load_sensors(sensors), load_arena(beside(vehicle.arena))
        )
    except FileError as error:
        raise CampaignError(str(error)) from None


def _early_end(path: Path, run: TomlTable, measures: Mapping[str, Measure]) -> EarlyEnd | None:
    if not run.has("until"):
        return None
    table = TomlTable(str(path), run.table("until"), "run.until", {"measure", "width", "least"}, CampaignError)
    measure = table.choice("measure", list(measures))
    return EarlyEnd(measure, table.number("width", 1e-9, 1e9), _whole(table, "least", 2, MOST_CASES, LEAST_CASES))


def _worst(run: TomlTable, measures: Mapping[str, Measure]) -> tuple[str, ...]:
    if not run.has("worst"):
        return ()
    given = run.table("worst")
    if not isinstance(given, list) or not all(isinstance(w, str) and w.removeprefix("-") in measures for w in given):
        raise run.error("worst", f"must be some of {', '.join(measures)} in brackets, with a minus where less is worse")
    return tuple(given)


def _required(path: Path, given: Any, measures: Mapping[str, Measure]) -> dict[str, float]:  # noqa: ANN401 - of a file
    table = TomlTable(str(path), given, "require", set(measures), CampaignError)
    return {name: table.number(name, 0.0, 1.0 if measures[name].is_judgement else 1e9) for name in given}
