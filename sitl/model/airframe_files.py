"""Parameter sets of an airframe: TOML files with a unit and a source for every value."""

from __future__ import annotations

import hashlib
import math
import sys
import tomllib
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sitl.errors import SitlError
from sitl.model.airframe import (
    BATTERY,
    FIRST_ORDER,
    PASSIVE,
    REPORT,
    SATURATED,
    SHAFT,
    STALL,
    Airframe,
    Array,
    elevon_arm,
)
from sitl.model.propeller import hover_speed
from sitl.model.propeller_files import Propeller, PropellerError, PropellerFactors, load_propeller

CHOICES: dict[str, dict[str, int]] = {
    "actuator_model": {"saturated": SATURATED, "first-order": FIRST_ORDER},
    "aerodynamics": {"report": REPORT, "passive": PASSIVE, "stall": STALL},
    "energy_account": {"shaft": SHAFT, "battery": BATTERY},
}
UNITS = {
    "m": "kg", "J1": "kg m2", "J2": "kg m2", "J3": "kg m2", "g": "m/s2", "rho": "kg/m3", "S": "m2", "b": "m",
    "c": "m", "S_ratio": "-", "C_l": "1/rad", "C_d0": "-", "C_y0": "-", "xi_f": "-", "xi_m": "-", "Delta_r": "m",
    "a_y": "m", "p_x": "m", "p_y": "m", "k_f": "kg m", "k_m": "kg m2", "C_lp": "-", "C_lq": "-", "C_lr": "-",
    "C_mp": "-", "C_mq": "-", "C_mr": "-", "C_np": "-", "C_nq": "-", "C_nr": "-", "mu": "-", "omega_min": "rad/s",
    "omega_max": "rad/s", "omega_rate": "rad/s2", "delta_max": "deg", "delta_rate": "rad/s",
    "actuator_model": "name", "motor_tau": "s", "elevon_tau": "s", "foot_x": "m", "foot_y": "m", "foot_z": "m",
    "aerodynamics": "name", "energy_account": "name",
    "max_contact_speed": "m/s",
}  # fmt: skip
STALL_UNITS = {"C_90": "-", "stall_angle": "deg", "cp_shift": "m", "J_p": "kg m2"}  # of the level "stall" alone
# What that level may state besides.
SLIPSTREAM_UNITS = {"slip_shift": "m", "blown_share": "-", "swirl": "-", "k_fc": "kg/m", "k_h": "kg"}
BATTERY_UNITS = {  # where the battery's energy is counted
    "motor_constant": "V s", "motor_resistance": "ohm", "idle_current": "A", "controller_efficiency": "-",
    "avionics_power": "W", "battery_voltage": "V", "battery_resistance": "ohm",
}  # fmt: skip
PROPELLER_KEYS = ("k_f", "k_m", "S_ratio")  # what a propeller of ours states, and a set without one states itself
FACTOR_UNITS = dict.fromkeys(PropellerFactors._fields, "-")  # a set with a propeller may state these besides
ALL_UNITS = UNITS | STALL_UNITS | SLIPSTREAM_UNITS | BATTERY_UNITS | FACTOR_UNITS | {"propeller": "name"}
SIGNED = frozenset({"Delta_r", "xi_m", "C_y0", "C_lp", "C_lq", "C_lr", "C_mp", "C_mq", "C_mr", "C_np", "C_nq", "C_nr"})
NOT_NEGATIVE = frozenset(
    {"C_d0", "mu", "cp_shift", "slip_shift", "swirl", "k_fc", "k_h", "J_p", "idle_current", "avionics_power"}
)
# Instruments state their vibration for 600 rad/s, near which vehicles fly that hover at 600 to 700; for others it goes
# with the speed of their own hover.
STATED_VIBRATION, BELOW_HOVER = 600.0, 6.0 / 7.0  # [rad/s], [-]
MEASURED_INERTIA = 1.05  # an inertia over the sum of the other two, which an error of measurement may make of 1
FORM_ROUNDING = 1e-9  # of the eigenvalues of a form, relative to coefficients of the size of one


class AirframeError(SitlError):
    """A parameter set cannot be used; the message names file, key and value."""


class SourcedValue(NamedTuple):
    """One value of a set, with its unit and where it comes from."""

    value: float | str
    unit: str
    source: str


@dataclass(frozen=True)
class ParameterSet:
    """A validated parameter set of an airframe, and where it comes from."""

    name: str
    description: str
    path: str
    sha256: str  # of the file itself, and its propeller's: so that a log can name what was flown
    values: Mapping[str, SourcedValue]
    parameters: Airframe
    waived: frozenset[str]  # rules that the set breaks on purpose
    warnings: tuple[str, ...] = ()  # what is doubtful of it, and still can be flown


def available() -> list[str]:
    """Names of the shipped sets."""
    return sorted(
        entry.name.removesuffix(".toml")
        for entry in files("sitl.model.airframes").iterdir()
        if entry.name.endswith(".toml")
    )


def load(name_or_path: str) -> ParameterSet:
    """Load a shipped set by name, or a TOML file by path.

    Raises:
        AirframeError: If there is no such set, or the file is not valid.
    """
    path = Path(name_or_path)
    return _loaded(path) if path.suffix == ".toml" else _shipped(name_or_path)


RENAMED = {"physical": "collage"}  # sets, by the names that they had


@cache
def _shipped(name: str) -> ParameterSet:
    if name in RENAMED:
        raise AirframeError(f"the parameter set {name!r} is called {RENAMED[name]!r} now")
    if name not in available():
        raise AirframeError(f"no parameter set {name!r}: there are {', '.join(available())}")
    return _loaded(Path(str(files("sitl.model.airframes") / f"{name}.toml")))


def _loaded(path: Path) -> ParameterSet:
    raw, table = _read(path)
    header = _header(path, table)
    base = load(header.base) if header.base else None
    own = {key: _entry(path, key, entry) for key, entry in table.items()}
    if "propeller" in own:
        own["propeller"] = _beside(path, own["propeller"])
    _check_propeller(path, own, base)
    values = (dict(base.values) if base else {}) | own
    missing = [key for key in _required(values) if key not in values]
    if missing:
        raise AirframeError(f"{path}: {', '.join(missing)} missing")
    parameters = _airframe(path, {key: _number(path, key, values[key]) for key in _required(values)}, values)
    waived = header.waived | (base.waived if base else frozenset())
    _check_together(path, parameters, waived)
    digest = hashlib.sha256(raw + _propeller_bytes(own)).hexdigest()
    return ParameterSet(
        name=header.name,
        description=header.description,
        path=str(path),
        sha256=digest,
        values=values,
        parameters=parameters,
        waived=waived,
        warnings=() if "inertia" in waived else tuple(f"{path}: {text}" for text in _doubtful(parameters)),
    )


def _read(path: Path) -> tuple[bytes, dict[str, Any]]:
    try:
        raw = path.read_bytes()
        return raw, tomllib.loads(raw.decode(_encoding(raw)))
    except OSError as error:
        raise AirframeError(f"{path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeError) as error:
        raise AirframeError(f"{path}: not a TOML file: {error}") from error


def _beside(path: Path, propeller: SourcedValue) -> SourcedValue:
    """The propeller of a set: one of ours, or a file of the user's, whose path is taken from the set's own folder."""
    name = propeller.value
    if not isinstance(name, str):
        raise AirframeError(f"{path}: propeller = {name!r} must be a name, or a TOML file beside this one")
    return propeller._replace(value=str(path.parent / name)) if name.endswith(".toml") else propeller


def _propeller_bytes(own: Mapping[str, SourcedValue]) -> bytes:
    """The file of a propeller that is none of ours, whose bytes belong to what is flown."""
    name = str(own["propeller"].value) if "propeller" in own else ""
    return Path(name).read_bytes() if name.endswith(".toml") else b""


def _encoding(raw: bytes) -> str:
    """UTF-8, or what a byte order mark says: editors of Windows write one."""
    return "utf-16" if raw.startswith((BOM_UTF16_LE, BOM_UTF16_BE)) else "utf-8-sig"


def _required(values: Mapping[str, SourcedValue]) -> list[str]:
    """Keys of numbers that a set must have, and those that it may; without its names, those of the report's sets."""

    def chosen(key: str, name: str) -> bool:
        return key in values and values[key].value == name

    units = UNITS | (STALL_UNITS if chosen("aerodynamics", "stall") else {})
    units |= BATTERY_UNITS if chosen("energy_account", "battery") else {}
    free = FACTOR_UNITS | (SLIPSTREAM_UNITS if chosen("aerodynamics", "stall") else {})
    return [key for key in units if key not in PROPELLER_KEYS or "propeller" not in values] + [
        key for key in free if key in values
    ]


def _check_propeller(path: Path, own: dict[str, SourcedValue], base: ParameterSet | None) -> None:
    """One set, one propeller: who states a part of it states all of it."""
    told = [key for key in PROPELLER_KEYS if key in own]
    if "propeller" in own and told:
        raise AirframeError(f"{path}: {', '.join(told)} beside propeller: they are the propeller's")
    if told and base is not None and "propeller" in base.values:
        raise AirframeError(f"{path}: {', '.join(told)} would not count: base {base.name!r} has a propeller")
    factors = [key for key in FACTOR_UNITS if key in own]
    if factors and "propeller" not in own.keys() | (base.values.keys() if base else set()):
        raise AirframeError(f"{path}: {', '.join(factors)} without a propeller to which they belong")
    if len({"k_f", "k_m"} & own.keys()) == 1:
        raise AirframeError(f"{path}: {told[0]} without the other of k_f and k_m: they are one propeller's")


def _airframe(path: Path, numbers: dict[str, Any], values: dict[str, SourcedValue]) -> Airframe:
    """The kernels' constants of what the set states."""
    if "stall_angle" in numbers:
        numbers["per_stall"] = 1.0 / math.sin(numbers.pop("stall_angle")) ** 2
    factors = PropellerFactors(**{key: numbers.pop(key) for key in FACTOR_UNITS if key in numbers})
    numbers.setdefault("slip_shift", numbers.get("cp_shift", 0.0))
    if "propeller" in values:
        propeller = _propeller(path, str(values["propeller"].value), factors)
        disc = factors.disc_factor * propeller.disc
        numbers |= propeller.constants(numbers["rho"])
        numbers |= {"S_p": disc, "S_ratio": numbers.get("blown_share", 0.5) * numbers["S"] / (2.0 * disc)}
    a = Airframe(**numbers)
    hover = hover_speed(a)
    return a._replace(vibration_speed=min(max(BELOW_HOVER * hover, STATED_VIBRATION), hover))


def _propeller(path: Path, name_or_path: str, factors: PropellerFactors) -> Propeller:
    """The propeller of a set with its factors.

    Raises:
        PropellerError: Names the set besides the propeller.
    """
    try:
        return load_propeller(name_or_path).corrected(factors)
    except PropellerError as error:
        raise PropellerError(f"{path}: {error}") from error


class _Header(NamedTuple):
    name: str
    description: str
    base: str = ""  # a shipped set from which this one differs
    waived: frozenset[str] = frozenset()


def _header(path: Path, table: dict[str, Any]) -> _Header:
    header = table.pop("set", None)
    if not isinstance(header, dict) or not {"name", "description"} <= header.keys():
        raise AirframeError(f"{path}: a [set] table with name and description is missing")
    for key in header.keys() - {"waived"}:
        if key not in _Header._fields:
            raise AirframeError(f"{path}: [set] has an unknown key {key!r}" + _nearest(key, _Header._fields))
        if not isinstance(header[key], str):
            raise AirframeError(f"{path}: [set] {key} = {header[key]!r} must be text")
    base = header.get("base", "")
    if base and base not in available():
        raise AirframeError(f"{path}: base {base!r} is not a shipped set: there are {', '.join(available())}")
    waived = header.get("waived", [])
    if not isinstance(waived, list) or not all(isinstance(rule, str) and rule in RULES for rule in waived):
        raise AirframeError(f"{path}: waived = {waived!r} must be a list of {', '.join(RULES)}")
    return _Header(header["name"], header["description"], base, frozenset(waived))


def _nearest(key: str, known: Iterable[str]) -> str:
    near = get_close_matches(key, known, n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def _entry(path: Path, key: str, entry: object) -> SourcedValue:
    if key not in ALL_UNITS:
        raise AirframeError(f"{path}: unknown key {key!r}" + _nearest(key, ALL_UNITS))
    if not isinstance(entry, dict) or entry.keys() != {"value", "unit", "source"}:
        raise AirframeError(f"{path}: {key} must be {{ value = ..., unit = ..., source = ... }}")
    if entry["unit"] != ALL_UNITS[key]:
        raise AirframeError(f"{path}: {key} is in {entry['unit']!r}, must be in {ALL_UNITS[key]!r}")
    if not isinstance(entry["source"], str) or not entry["source"]:
        raise AirframeError(f"{path}: {key} names no source")
    return SourcedValue(entry["value"], entry["unit"], entry["source"])


def _number(path: Path, key: str, entry: SourcedValue) -> float:
    value = entry.value
    if key in CHOICES:
        if value not in CHOICES[key]:
            raise AirframeError(f"{path}: {key} {value!r} is not one of {', '.join(CHOICES[key])}")
        return CHOICES[key][str(value)]
    # An integer of TOML may be too large for a float.
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < sys.float_info.max:
        raise AirframeError(f"{path}: {key} = {value!r} is not a finite number")
    if key not in SIGNED | NOT_NEGATIVE and value <= 0.0:
        raise AirframeError(f"{path}: {key} = {value} must be positive")
    if key in NOT_NEGATIVE and value < 0.0:
        raise AirframeError(f"{path}: {key} = {value} must not be negative")
    return math.radians(value) if entry.unit == "deg" else float(value)


def passive_loss(a: Airframe) -> Array:
    r"""Loss of the body by ``passive_wrench`` in still air, the motors stopped, as a form of second degree.

    The power lost is :math:`\frac12 \rho S \eta\, x^T Q x` with x = (d1 v_x, d2 v_x, v, w): where Q is positive
    semidefinite, no motion whatever gains energy.

    Returns:
        Q, symmetric, shape (8, 8).
    """
    D1, D2, VX, VY, VZ, WX, WY, WZ = range(8)
    grip, side = a.C_l * a.xi_f, a.b * (a.Delta_r / a.c) * a.C_y0
    Q = np.zeros((8, 8))
    Q[VX, VX], Q[VY, VY], Q[VZ, VZ] = a.C_d0, a.C_y0, a.C_l
    Q[VY, WZ], Q[VZ, WY] = -2.0 * side, 2.0 * a.C_l * a.Delta_r
    for elevon, arm in ((D1, a.a_y), (D2, -a.a_y)):
        Q[elevon, [elevon, VZ, WX, WY]] = 0.5 * grip * np.array([1.0, 1.0, arm, elevon_arm(a)])
    rows = ((a.C_lp, a.C_lq, a.C_lr), (a.C_mp, a.C_mq, a.C_mr), (a.C_np, a.C_nq, a.C_nr))
    lengths = np.array([a.b, a.c, a.b])
    Q[WX:, WX:] = 0.5 * np.outer(lengths, lengths) * np.array(rows)
    return 0.5 * (Q + Q.T)


def _takes_energy(a: Airframe) -> bool:
    """Whether no motion through still air, the motors stopped, gives the wing energy."""
    if a.aerodynamics == STALL:  # whose strips damp the roll
        return a.C_mq >= 0.0 and a.C_nr >= 0.0
    return bool(np.linalg.eigvalsh(passive_loss(a)).min() > -FORM_ROUNDING)


def _inertia_excess(a: Airframe) -> float:
    """The greatest inertia over the sum of the other two."""
    largest = max(a.J1, a.J2, a.J3)
    return largest / (a.J1 + a.J2 + a.J3 - largest)


def _doubtful(a: Airframe) -> list[str]:
    """Warnings of values that no airframe can have, and a measured one may seem to have."""
    excess = _inertia_excess(a)
    if excess < 1.0:
        return []
    return [
        f"J1 = {a.J1}, J2 = {a.J2}, J3 = {a.J3}: one is {100.0 * (excess - 1.0):.1f} % above the sum of the other two;"
        " taken as measured"
    ]


class _Rule(NamedTuple):
    holds: Callable[[Airframe], bool]
    text: str


RULES = {
    "inertia": _Rule(
        lambda a: _inertia_excess(a) < MEASURED_INERTIA,
        "J1 = {0.J1}, J2 = {0.J2}, J3 = {0.J3}: no rigid body has an inertia above the sum of the other two",
    ),
    "elevons": _Rule(
        lambda a: elevon_arm(a) > 0.0,
        "Delta_r = {0.Delta_r} and xi_m = {0.xi_m}: the elevons must be behind the centre of mass",
    ),
    "blown": _Rule(lambda a: a.blown_share <= 1.0, "blown_share = {0.blown_share}: more than the wing is blown"),
    "speeds": _Rule(
        lambda a: a.omega_min < a.omega_max, "omega_min = {0.omega_min} must be below omega_max = {0.omega_max}"
    ),
    "deflection": _Rule(lambda a: a.delta_max < math.pi / 2, "delta_max = {0.delta_max} rad must be below 90 deg"),
    "weight": _Rule(
        lambda a: 2.0 * (1.0 - a.S_ratio * a.C_d0) * (a.k_f * a.omega_max**2 + a.k_fw * a.omega_max) > a.m * a.g,
        "k_f = {0.k_f} and omega_max = {0.omega_max} cannot lift m = {0.m}",
    ),
    "damping": _Rule(
        lambda a: a.aerodynamics == REPORT or _takes_energy(a),
        "C_lp = {0.C_lp}, C_lr = {0.C_lr}, C_np = {0.C_np}, C_nr = {0.C_nr}, C_mq = {0.C_mq}: the wing gains energy",
    ),
    "slipstream": _Rule(
        lambda a: a.S_ratio * a.C_d0 < 1.0, "S_ratio = {0.S_ratio} with C_d0 = {0.C_d0} leaves no thrust"
    ),
}


def _check_together(path: Path, a: Airframe, waived: frozenset[str]) -> None:
    for name, rule in RULES.items():
        if name not in waived and not rule.holds(a):
            raise AirframeError(f"{path}: {rule.text.format(a)}")
