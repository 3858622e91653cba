"""Specifications of the instruments: TOML files with a unit and a source for every value."""

from __future__ import annotations

import math
import sys
import tomllib
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

from protocol.tools.files import decode_text
from sitl.errors import SitlError
from sitl.model.arithmetic import sine_cosine
from sitl.model.quaternions import from_euler
from sitl.model.vectors import Vector
from sitl.sensors.draws import Timing
from sitl.sensors.instruments import STANDARD_GRAVITY, SensorSet

SCALES = {
    "-": 1.0, "s": 1.0, "Hz": 1.0, "m": 1.0, "mm": 1e-3, "m/s": 1.0, "m/s2": 1.0, "V": 1.0, "A": 1.0, "uT": 1e-6,
    "deg": math.pi / 180.0, "deg/s": math.pi / 180.0, "deg/s/sqrt(Hz)": math.pi / 180.0, "g": STANDARD_GRAVITY,
    "mg": 1e-3 * STANDARD_GRAVITY,
    "ug/sqrt(Hz)": 1e-6 * STANDARD_GRAVITY,
}  # fmt: skip
FIELD = ("field_strength", "field_inclination", "field_declination")
IMU_ANGLES = ("imu_roll", "imu_pitch", "imu_yaw")
MOUNTED = ("imu", "antenna")
ARMS = tuple(f"{place}_{axis}" for place in MOUNTED for axis in "xyz")
MAY_BE_NEGATIVE = (*FIELD, *IMU_ANGLES, *ARMS)
POSITIVE = ("rate", "step", "range", "drift_time", "lag", "field_strength", "servo_rate", "motor_rate")
TRUTHFUL = "truthful"  # names the shipped file of instruments that wander, stand aside and lie askew
MAX_DELAY = 0.5  # delay and three times the jitter: what the estimator can look back [s]
MAX_READING_RATE = 100.0  # every fifth control period [Hz]
MAX_POSE_RATE = 250.0  # of motion capture: every other one [Hz]
MAX_LATENCY = 0.1  # of the pipeline [s]
MIN_TIME = 0.01  # of a lag or a drift: what is shorter the steps of time do not follow [s]
MAX_INCLINATION = math.radians(85.0)  # of the magnetic field, whose level part tells north


class SensorError(SitlError):
    """A specification cannot be used; the message names file, key and value."""


class Entry(NamedTuple):
    """One value with its unit and source."""

    value: float  # as the file says it
    unit: str
    source: str


Table = dict[str, dict[str, Entry]]  # instrument -> key -> entry


@cache
def shipped() -> Table:
    """The specifications that are shipped."""
    table: Table = {}
    for entry in sorted(files("sitl.sensors.data").iterdir(), key=lambda entry: entry.name):
        if entry.name.endswith(".toml"):
            table |= _read(Path(str(entry)))
    return table


@cache
def load_sensors(path: str | None = None) -> SensorSet:
    """The instruments as shipped, or as a file states some of their values anew.

    Args:
        path: A TOML file with tables such as ``[gnss.delay]``, each ``value``, ``unit`` and ``source``; or
            ``truthful``, a shipped one.

    Raises:
        SensorError: If the file is not valid; the message names file, key and value.
    """
    table = shipped()
    if path is not None:
        own = _read(Path(str(files("sitl.sensors") / "truthful.toml")) if path == TRUTHFUL else Path(path))
        _check_known(path, own, table)
        table = {name: {**entries, **own.get(name, {})} for name, entries in table.items()}
    return _sensors(path or "the shipped sensors", table)


def _read(path: Path) -> Table:
    try:
        raw = tomllib.loads(decode_text(path.read_bytes()))
    except OSError as error:
        raise SensorError(f"{path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeError) as error:
        raise SensorError(f"{path}: not a TOML file: {error}") from error
    table: Table = {}
    for name, entries in raw.items():
        if not isinstance(entries, dict):
            raise SensorError(f"{path}: {name} must be a table of values")
        table[name] = {key: _entry(path, f"{name}.{key}", entry) for key, entry in entries.items()}
    return table


def _entry(path: Path, where: str, entry: object) -> Entry:
    if not isinstance(entry, dict) or entry.keys() != {"value", "unit", "source"}:
        raise SensorError(f"{path}: {where} must be {{ value = ..., unit = ..., source = ... }}")
    value = entry["value"]
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < sys.float_info.max:
        raise SensorError(f"{path}: {where} = {value!r} is not a finite number")
    if not isinstance(entry["source"], str) or not entry["source"]:
        raise SensorError(f"{path}: {where} names no source")
    return Entry(float(value), str(entry["unit"]), entry["source"])


def _check_known(path: str, own: Table, known: Table) -> None:
    for name, entries in own.items():
        if name not in known:
            raise SensorError(f"{path}: there is no instrument {name!r}" + _nearest(name, known))
        for key, entry in entries.items():
            if key not in known[name]:
                raise SensorError(f"{path}: {name} has no {key!r}" + _nearest(key, known[name]))
            if entry.unit != known[name][key].unit:
                raise SensorError(f"{path}: {name}.{key} is in {entry.unit!r}, must be in {known[name][key].unit!r}")


def _nearest(key: str, known: Iterable[str]) -> str:
    near = get_close_matches(key, known, n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def _sensors(path: str, table: Table) -> SensorSet:
    parts = {}
    for name, kind in get_type_hints(SensorSet).items():
        numbers = {key: entry.value * SCALES[entry.unit] for key, entry in table[name].items()}
        _check_signs(path, name, numbers)
        if name == "magnetometer":
            _check_inclination(path, numbers["field_inclination"])
            numbers |= _field(*(numbers.pop(key) for key in FIELD))
        places: dict[str, Any] = {}
        if name == "mounting":
            places = {place: Vector(*(numbers.pop(f"{place}_{axis}") for axis in "xyz")) for place in MOUNTED}
            places["imu_attitude"] = from_euler(*(numbers.pop(key) for key in IMU_ANGLES))
        parts[name] = kind(**_with_timing(path, name, kind, numbers), **places)
    latency = parts["pipeline"].latency
    if latency > MAX_LATENCY:
        raise SensorError(f"{path}: pipeline.latency = {latency:g} s is above {MAX_LATENCY:g} s")
    return SensorSet(**parts)


def _check_signs(path: str, name: str, numbers: Mapping[str, float]) -> None:
    for key, value in numbers.items():
        if value < 0.0 and key not in MAY_BE_NEGATIVE:
            raise SensorError(f"{path}: {name}.{key} = {value:g} must not be negative")
        if value == 0.0 and key in POSITIVE:
            raise SensorError(f"{path}: {name}.{key} must be positive")
        if value < MIN_TIME and (key in ("drift_time", "lag") or (key == "noise_time" and value > 0.0)):
            raise SensorError(f"{path}: {name}.{key} = {value:g} s is below {MIN_TIME:g} s")


def _check_inclination(path: str, inclination: float) -> None:
    if abs(inclination) > MAX_INCLINATION + 1e-9:
        at_most = f"leaves no level field to tell north by; at most {math.degrees(MAX_INCLINATION):g} deg"
        raise SensorError(f"{path}: magnetometer.field_inclination = {math.degrees(inclination):g} deg {at_most}")


def _with_timing(path: str, name: str, kind: Any, numbers: dict[str, float]) -> dict[str, Any]:  # noqa: ANN401
    if "timing" not in kind._fields:
        return numbers
    timing = Timing(*(numbers.pop(key) for key in Timing._fields))
    most = MAX_POSE_RATE if name == "motion_capture" else MAX_READING_RATE
    if timing.rate > most:
        raise SensorError(f"{path}: {name}.rate = {timing.rate:g} Hz is above {most:g} Hz")
    if timing.delay + 3.0 * timing.jitter > MAX_DELAY:
        raise SensorError(f"{path}: {name}.delay = {timing.delay:g} s with its jitter is above {MAX_DELAY:g} s")
    if timing.dropout > 1.0:
        raise SensorError(f"{path}: {name}.dropout = {timing.dropout:g} is above 1")
    return {"timing": timing, **numbers}


def _field(strength: float, inclination: float, declination: float) -> dict[str, float]:
    """The earth's field in the world frame NWU [T]; inclination is positive downwards, declination eastwards."""
    sine, cosine = sine_cosine(inclination)
    eastwards, northwards = sine_cosine(declination)
    return {
        "field_north": strength * cosine * northwards,
        "field_west": -strength * cosine * eastwards,
        "field_up": -strength * sine,
    }
