"""A user's meanings for the names of a build: a TOML file with the tables [functions] and [variables]."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from protocol.flight_plans.known_names import CONSTANTS, FUNCTIONS, VARIABLES
from protocol.flight_plans.place import FlightPlanError, Place
from protocol.tools.files import decode_text

__all__ = ["NameMapping", "load_name_mapping", "parse_name_mapping"]

MAX_MAPPING_SIZE = 100_000  # [bytes]
_NAME = re.compile(r"[A-Za-z_]\w*((\.|->)[A-Za-z_]\w*)*", re.ASCII)


@dataclass(frozen=True, slots=True)
class NameMapping:
    """Names of a build, each a number or a known name."""

    functions: Mapping[str, float | int | str] = field(default_factory=lambda: MappingProxyType({}))
    variables: Mapping[str, float | int | str] = field(default_factory=lambda: MappingProxyType({}))


def load_name_mapping(path: Path | str) -> NameMapping:
    """Read a mapping.

    Raises:
        FlightPlanError: It cannot be read, or a line of it is not valid.
    """
    path = Path(path)
    place = Place(str(path), 0, 0)
    try:
        with path.open("rb") as file:
            data = file.read(MAX_MAPPING_SIZE + 1)
    except OSError as error:
        raise FlightPlanError(place, f"cannot be read: {error.strerror}") from None
    if len(data) > MAX_MAPPING_SIZE:
        raise FlightPlanError(place, f"longer than {MAX_MAPPING_SIZE} bytes")
    try:
        return parse_name_mapping(decode_text(data), str(path))
    except UnicodeError as error:
        raise FlightPlanError(place, f"not a text in UTF-8: {error}") from None


def parse_name_mapping(text: str, name: str) -> NameMapping:
    """A mapping from the text of a file called ``name``; errors as of ``load_name_mapping``."""
    place = Place(name, 0, 0)
    try:
        tables = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise FlightPlanError(place, f"not TOML: {error}") from None
    for key in tables:
        if key not in {"functions", "variables"}:
            raise FlightPlanError(place, f"unknown table [{key}]: only [functions] and [variables]")
    functions = _table(tables.get("functions", {}), "functions", frozenset(FUNCTIONS), place)
    variables = _table(tables.get("variables", {}), "variables", VARIABLES | frozenset(CONSTANTS), place)
    return NameMapping(functions, variables)


def _table(table: object, title: str, known: frozenset[str], place: Place) -> Mapping[str, float | int | str]:
    if not isinstance(table, dict):
        raise FlightPlanError(place, f"[{title}] is not a table")
    meanings: dict[str, float | int | str] = {}
    for name, value in _flat(table):
        what = f"[{title}] {name}"
        if not _NAME.fullmatch(name):
            raise FlightPlanError(place, f"{what}: not a name")
        if name in known:
            raise FlightPlanError(place, f"{what}: is known already")
        if isinstance(value, str):
            if value not in known:
                raise FlightPlanError(place, f"{what}: {value!r} is not a known {title.removesuffix('s')}")
        elif not isinstance(value, int | float) or not math.isfinite(value):
            raise FlightPlanError(place, f"{what}: {value!r} is neither a number nor a known name")
        meanings[name.replace("->", ".")] = int(value) if isinstance(value, bool) else value
    return MappingProxyType(meanings)


def _flat(table: Mapping[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    """Names and values; TOML makes a table of a dotted name."""
    pairs: list[tuple[str, Any]] = []
    for key, value in table.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict) and value:
            pairs += _flat(value, f"{name}.")
        else:
            pairs.append((name, value))
    return pairs
