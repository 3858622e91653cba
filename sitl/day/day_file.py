"""Days from TOML files: every key is known and every value checked; docs/day.md describes the format."""

from __future__ import annotations

import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from protocol.names import FAILURE_TYPES, FAILURE_UNITS
from protocol.tools.files import decode_text
from sitl.errors import SitlError
from sitl.simulation.avionics import Navigation
from sitl.tools.toml_table import TomlTable

MAX_DURATION = 7200.0  # [s]
DAY_KEYS = {
    "name", "seed", "duration", "arena", "plan", "plan_names", "airframe", "sensors", "navigation", "parameters",
    "wind", "operator", "failure",
}  # fmt: skip
ACTION_KEYS = {"at", "block", "waypoint", "to", "variable", "parameter", "value", "mode", "arm"}
ACTIONS = ("block", "waypoint", "variable", "parameter", "mode", "arm")


class DayError(SitlError):
    """A day cannot be flown as it is written; the message names file, key and value."""


class OperatorAction(NamedTuple):
    """An action of the operator at a time."""

    at: float  # [s]
    kind: str  # of ACTIONS
    name: str  # of the block, waypoint, variable, parameter or mode; empty for arming
    value: tuple[float, ...] = ()  # east, north, height of a waypoint [m]; a value; 1 to arm, 0 to disarm


class PlannedFailure(NamedTuple):
    """A failure at a time, and its duration."""

    at: float  # [s]
    unit: str  # of FAILURE_UNITS
    failure: str  # of FAILURE_TYPES
    instance: int  # 1 left, 2 right, 0 all
    lasts: float  # [s]; infinite: for good


class Day(NamedTuple):
    """A day as it is written."""

    name: str
    seed: int
    duration: float  # [s]
    arena: str  # name or path
    plan: Path | None
    plan_names: Path | None
    airframe: str | None
    sensors: Path | None
    navigation: Navigation | None  # None: that of the arena
    parameters: dict[str, float]
    schedule: tuple[tuple[float, float], ...]  # of the wind wall: time [s], speed [m/s]
    bursts: tuple[tuple[float, float, float], ...]  # begin [s], duration [s], rise [m/s]
    actions: tuple[OperatorAction, ...]
    failures: tuple[PlannedFailure, ...]


def load_day(path: Path) -> Day:
    """Read a day; files that it names stand beside it.

    Raises:
        DayError: The file cannot be read, or something in it is missing, unknown or out of bounds.
    """
    try:
        content = tomllib.loads(decode_text(path.read_bytes()))
    except OSError as error:
        raise DayError(f"{path}: cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeError) as error:
        raise DayError(f"{path}: is not TOML: {error}") from None
    table = TomlTable(str(path), content, "", DAY_KEYS, DayError)
    duration = table.number("duration", 1.0, MAX_DURATION)
    wind = TomlTable(str(path), content.get("wind", {}), "wind", {"schedule", "gusts"}, DayError)
    day = Day(
        name=table.text("name"),
        seed=int(table.number("seed", 0, 2**31 - 1, 1)),
        duration=duration,
        arena=_arena(path, table),
        plan=_beside(path, table, "plan"),
        plan_names=_beside(path, table, "plan_names"),
        airframe=table.text("airframe") if table.has("airframe") else None,
        sensors=_beside(path, table, "sensors"),
        navigation=_navigation(table),
        parameters=_parameters(path, content.get("parameters", {})),
        schedule=tuple((time, speed) for time, speed in wind.lines("schedule", 2)),
        bursts=tuple((begin, lasts, rise) for begin, lasts, rise in wind.lines("gusts", 3)),
        actions=tuple(_action(path, entry, k, duration) for k, entry in enumerate(table.tables("operator"))),
        failures=tuple(_failure(path, entry, k, duration) for k, entry in enumerate(table.tables("failure"))),
    )
    if any(later[0] <= earlier[0] for earlier, later in pairwise(day.schedule)):
        raise wind.error("schedule", "has times that do not increase")
    return day


def _beside(path: Path, table: TomlTable, key: str) -> Path | None:
    return path.parent / table.text(key) if table.has(key) else None


def _arena(path: Path, table: TomlTable) -> str:
    """A shipped arena's name, or the path of a file beside the day."""
    name = table.text("arena")
    return str(path.parent / name) if name.endswith(".toml") else name


def _navigation(table: TomlTable) -> Navigation | None:
    return Navigation(table.choice("navigation", [n.value for n in Navigation])) if table.has("navigation") else None


def _parameters(path: Path, given: object) -> dict[str, float]:
    if not isinstance(given, dict):
        raise DayError(f"{path}: parameters must be a table")
    table = TomlTable(str(path), given, "parameters", set(given), DayError)
    return {name: table.number(name, -1e9, 1e9) for name in given}


def _action(path: Path, entry: dict[str, Any], number: int, duration: float) -> OperatorAction:
    table = TomlTable(str(path), entry, f"operator[{number}]", ACTION_KEYS, DayError)
    kinds = [kind for kind in ACTIONS if table.has(kind)]
    if len(kinds) != 1:
        raise table.error("", f"must have one of {', '.join(ACTIONS)}")
    kind, at = kinds[0], table.number("at", 0.0, duration)
    if kind == "arm":
        return OperatorAction(at, kind, "", (float(table.flag("arm")),))
    value: tuple[float, ...] = ()
    if kind == "waypoint":
        value = tuple(table.numbers("to", 3, -1e5, 1e5))
    elif kind in {"variable", "parameter"}:
        value = (table.number("value", -1e9, 1e9),)
    return OperatorAction(at, kind, table.text(kind), value)


def _failure(path: Path, entry: dict[str, Any], number: int, duration: float) -> PlannedFailure:
    keys = {"at", "unit", "failure", "instance", "lasts"}
    table = TomlTable(str(path), entry, f"failure[{number}]", keys, DayError)
    return PlannedFailure(
        at=table.number("at", 0.0, duration),
        unit=table.choice("unit", list(FAILURE_UNITS)),
        failure=table.choice("failure", [name for name in FAILURE_TYPES if name != "ok"]),
        instance=int(table.number("instance", 0, 2, 0)),
        lasts=table.number("lasts", 0.01, MAX_DURATION, float("inf")),
    )
