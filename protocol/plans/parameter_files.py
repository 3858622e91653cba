"""Parameter files of QGroundControl (.params) and of MAVProxy and Mission Planner (.parm): names and values.

QGroundControl: lines of vehicle, component, name, value and MAV_PARAM_TYPE, with tabs between, of all components that
have parameters. MAVProxy: a name and a value, with blanks or a comma between. ``#`` begins a comment in both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from protocol.errors import FileError
from protocol.names import MAX_NAME_LENGTH
from protocol.tools.files import decode_text, write_atomically
from protocol.wire.message import Source

MAVPROXY_SUFFIXES = {".parm", ".param"}
MAX_PARAMETER_FILE = 1 << 20  # of a file [byte]
QGC_COLUMNS = 5


class ParameterRow(NamedTuple):
    """One parameter of a file."""

    name: str
    value: float
    owner: Source | None  # system and component; None in files that do not tell it, which are the autopilot's
    place: str  # in the file


@dataclass(frozen=True, slots=True)
class ParameterFile:
    """The rows of a parameter file, in its order. One name may stand there once for each component."""

    path: Path
    rows: tuple[ParameterRow, ...]

    def of(self, vehicle: Source) -> dict[str, float]:
        """Names and values for a vehicle's component.

        Rows of a single vehicle are for any vehicle: a file may be loaded onto another one than it was saved from.

        Raises:
            FileError: It has rows of several vehicles, and none of this one.
        """
        system = self._system(vehicle[0])
        return {row.name: row.value for row in self.rows if row.owner in {None, (system, vehicle[1])}}

    def left_out(self, vehicle: Source) -> tuple[ParameterRow, ...]:
        """The rows of other components and vehicles; arguments and errors as of ``of``."""
        system = self._system(vehicle[0])
        return tuple(row for row in self.rows if row.owner not in {None, (system, vehicle[1])})

    def _system(self, wanted: int) -> int:
        systems = sorted({row.owner[0] for row in self.rows if row.owner is not None})
        if not systems or wanted in systems:
            return wanted
        if len(systems) > 1:
            raise FileError(f"{self.path}: has parameters of vehicles {_listed(systems)}, none of vehicle {wanted}")
        return systems[0]


def load_parameters(path: Path) -> ParameterFile:
    """A parameter file of either kind.

    Raises:
        FileError: The file cannot be read or a line cannot be understood; the message names the line.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    if len(data) > MAX_PARAMETER_FILE:
        raise FileError(f"{path}: {len(data)} bytes are too many for a parameter file")
    try:
        lines = decode_text(data, "replace").splitlines()  # a comment may be in any encoding
    except UnicodeError as error:
        raise FileError(f"{path}: not a text file: {error}") from error
    found: dict[tuple[Source | None, str], ParameterRow] = {}
    for number, line in enumerate(lines, 1):
        text = line.partition("#")[0].strip()
        if text:
            row = _parameter(text, f"{path}:{number}")
            if (row.owner, row.name) in found:
                raise FileError(f"{row.place}: {row.name} is given twice")
            found[row.owner, row.name] = row
    if not found:
        raise FileError(f"{path}: no parameters")
    return ParameterFile(path, tuple(found.values()))


def save_parameters(path: Path, values: Mapping[str, float], types: Mapping[str, int], vehicle: Source) -> None:
    """Write a file: MAVProxy's for names that end in .parm or .param, QGroundControl's for all others.

    Args:
        path: Of the file.
        values: By name.
        types: MAV_PARAM_TYPE by name; QGroundControl's files have them.
        vehicle: System and component id.

    Raises:
        FileError: The file cannot be written.
    """
    is_mavproxy = path.suffix in MAVPROXY_SUFFIXES
    write_atomically(
        path, (render_parm(values) if is_mavproxy else render_qgc_params(values, types, *vehicle)).encode()
    )


def render_qgc_params(values: Mapping[str, float], types: Mapping[str, int], system: int, component: int) -> str:
    """A file that QGroundControl loads.

    Args:
        values: By name.
        types: MAV_PARAM_TYPE by name.
        system: Of the vehicle.
        component: Of the vehicle.
    """
    lines = ["# Onboard parameters", "#", "# Vehicle-Id Component-Id Name Value Type"]
    lines += [f"{system}\t{component}\t{name}\t{_number(values[name])}\t{types[name]}" for name in sorted(values)]
    return "\n".join(lines) + "\n"


def render_parm(values: Mapping[str, float]) -> str:
    """A file that MAVProxy and Mission Planner load."""
    return "".join(f"{name:<{MAX_NAME_LENGTH}} {_number(values[name])}\n" for name in sorted(values))


def _parameter(text: str, place: str) -> ParameterRow:
    columns = text.split("\t") if text.count("\t") == QGC_COLUMNS - 1 else text.replace(",", " ").split()
    owner = None
    if len(columns) == QGC_COLUMNS:
        owner = _id(columns[0], "vehicle", place), _id(columns[1], "component", place)
        columns = columns[2:4]
    if len(columns) != 2:
        raise FileError(f"{place}: {text[:60]!r} is not a name and a value")
    name, number = columns[0].strip(), columns[1].strip()
    if not 0 < len(name) <= MAX_NAME_LENGTH or not name.isascii() or not name.replace("_", "").isalnum():
        raise FileError(f"{place}: {name[:40]!r} is not a parameter's name")
    try:
        value = float(number)
    except ValueError:
        raise FileError(f"{place}: {name} = {number[:40]!r} is not a number") from None
    if not math.isfinite(value):
        raise FileError(f"{place}: {name} = {number[:40]} is not a number")
    return ParameterRow(name, value, owner, place)


def _id(text: str, what: str, place: str) -> int:
    text = text.strip()
    if not (text.isascii() and text.isdigit() and int(text) < 256):
        raise FileError(f"{place}: {text[:40]!r} is not the id of a {what}, 0 to 255")
    return int(text)


def _listed(systems: Sequence[int]) -> str:
    return f"{', '.join(map(str, systems[:-1]))} and {systems[-1]}"


def _number(value: float) -> str:
    """With the digits of a single float, which is what the wire has."""
    return str(int(value)) if value == int(value) and abs(value) < 1e9 else f"{value:.9g}"
