"""Parameter files of QGroundControl (.params) and of MAVProxy and Mission Planner (.parm): names and values.

QGroundControl: lines of vehicle, component, name, value and MAV_PARAM_TYPE, with tabs between. MAVProxy: a name and a
value, with blanks or a comma between. ``#`` begins a comment in both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from protocol.errors import FileError
from protocol.names.parameter_names import MAX_NAME_LENGTH
from protocol.tools.atomic_write import write_atomically
from protocol.wire.message import Source

__all__ = ["load_parameters", "render_parm", "render_qgc_params", "save_parameters"]

MAVPROXY_SUFFIXES = {".parm", ".param"}
MAX_PARAMETER_FILE = 1 << 20  # of a file [byte]
QGC_COLUMNS = 5


def load_parameters(path: Path) -> dict[str, float]:
    """Names and values of a parameter file of either kind.

    Raises:
        FileError: The file cannot be read or a line cannot be understood; the message names the line.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    if len(data) > MAX_PARAMETER_FILE:
        raise FileError(f"{path}: {len(data)} bytes are too many for a parameter file")
    found: dict[str, float] = {}
    for number, line in enumerate(data.decode("utf-8", "replace").splitlines(), 1):
        text = line.partition("#")[0].strip()
        if text:
            name, value = _parameter(text, f"{path}:{number}")
            if name in found:
                raise FileError(f"{path}:{number}: {name} is given twice")
            found[name] = value
    if not found:
        raise FileError(f"{path}: no parameters")
    return found


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


def _parameter(text: str, place: str) -> tuple[str, float]:
    columns = text.split("\t") if text.count("\t") == QGC_COLUMNS - 1 else text.replace(",", " ").split()
    if len(columns) == QGC_COLUMNS:
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
    return name, value


def _number(value: float) -> str:
    """With the digits of a single float, which is what the wire has."""
    return str(int(value)) if value == int(value) and abs(value) < 1e9 else f"{value:.9g}"
