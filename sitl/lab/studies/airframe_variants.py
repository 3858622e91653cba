r"""Airframes made from one: similar ones of another mass, and ones whose constants are other by a fifth.

Every variant is written as a file of its own, as a user would write it, so that it is read and checked as one.

Similar vehicles have one shape, one air and one gravity: of a length ratio :math:`\lambda`, masses go with
:math:`\lambda^3` and times with :math:`\sqrt\lambda`. So every constant is carried over by its unit. The battery's
voltage is kept.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sitl.model.airframe_files import FACTOR_UNITS, ParameterSet, SourcedValue
from sitl.model.propeller_files import read_propeller

SIZES = (0.15, 0.25, 0.5, 1.0, 2.0, 3.5, 5.0)  # masses of similar vehicles [kg]
VARIED_BY = 0.2  # of a constant, either way
JOINT_DRAWS = 8  # of all constants at once
KEPT = frozenset({"g", "rho"})  # no constants of the vehicle
# Powers of the length ratio by which units go.
EXPONENTS = {"kg": 3.0, "m": 1.0, "s": 0.5, "W": 3.5, "A": 3.5, "ohm": -3.5, "V": 0.0, "rad": 0.0, "deg": 0.0}


class Variant(NamedTuple):
    """One airframe to be checked."""

    name: str
    path: str


def similar_factor(unit: str, length: float) -> float:
    """Factor of a quantity with a unit, such as kg m2 or rad/s2, of a similar vehicle.

    Args:
        unit: Of the quantity.
        length: Ratio of the lengths.
    """
    over, _, under = unit.partition("/")
    return float(length ** (_exponent(over) - _exponent(under)))


def _exponent(units: str) -> float:
    """Of the length ratio, by which a product of units goes."""
    total = 0.0
    for unit in units.split():
        name = unit.rstrip("0123456789")
        total += EXPONENTS.get(name, 0.0) * int(unit[len(name) :] or 1)
    return total


def write_similar(base: ParameterSet, mass: float, folder: Path) -> Variant:
    """A similar vehicle of some mass [kg]."""
    length = (mass / float(base.values["m"].value)) ** (1.0 / 3.0)
    values = {key: _carried_over(entry, length) for key, entry in base.values.items()}
    name = f"similar-{mass:g}kg"
    if "propeller" in values:
        table = similar_propeller(read_propeller(str(values["propeller"].value)), length)
        (folder / f"{name}-propeller.toml").write_text(_toml(table), encoding="utf-8")
        values["propeller"] = values["propeller"]._replace(value=f"{name}-propeller.toml")
    return _written(base, name, values, folder)


def _carried_over(entry: SourcedValue, length: float) -> SourcedValue:
    if isinstance(entry.value, str):
        return entry
    return entry._replace(value=entry.value * similar_factor(entry.unit, length))


def similar_propeller(table: Mapping[str, Any], length: float) -> dict[str, Any]:
    """The table of a propeller of the same shape: one curve by the advance ratio, its bench at like speeds."""
    scaled = {key: dict(part) for key, part in table.items()}
    scaled["propeller"]["diameter"] *= length
    if "bench" in scaled:
        slower, stronger = length**-0.5, length**3
        scaled["bench"]["table_rpm"] *= slower
        scaled["bench"]["rows"] = [[rpm * slower, T * stronger] for rpm, T in scaled["bench"]["rows"]]
    return scaled


def varied_keys(base: ParameterSet) -> list[str]:
    """The constants that are varied: every number of the vehicle that is not zero, and the propeller's factors."""
    known = [key for key, entry in base.values.items() if entry.value and not isinstance(entry.value, str)]
    factors = FACTOR_UNITS if "propeller" in base.values else {}
    return [key for key in dict.fromkeys([*known, *factors]) if key not in KEPT]


def write_varied(base: ParameterSet, name: str, factors: Mapping[str, float], folder: Path) -> Variant:
    """The airframe with some of its constants multiplied.

    A body has no inertia above the sum of the other two: J3, the greatest of a wing's, is cut there.
    """
    values = dict(base.values)
    for key, factor in factors.items():
        entry = values.get(key, SourcedValue(1.0, "-", "as of its table"))
        values[key] = entry._replace(value=float(entry.value) * factor)
    J1, J2, J3 = (float(values[key].value) for key in ("J1", "J2", "J3"))
    if factors.keys() & {"J1", "J2", "J3"}:
        values["J3"] = values["J3"]._replace(value=min(J3, J1 + J2))
    return _written(base, name, values, folder)


def write_all(base: ParameterSet, folder: Path, draws: int = JOINT_DRAWS) -> Iterator[Variant]:
    """All variants of an airframe: similar ones, each constant by itself either way, and all of them at once."""
    for mass in SIZES:
        yield write_similar(base, mass, folder)
    for key in varied_keys(base):
        for factor in (1.0 - VARIED_BY, 1.0 + VARIED_BY):
            yield write_varied(base, f"{key}-{100.0 * factor:.0f}", {key: factor}, folder)
    for number, factors in enumerate(joint_factors(varied_keys(base), draws)):
        yield write_varied(base, f"joint-{number}", factors, folder)


def joint_factors(keys: list[str], draws: int, seed: int = 1) -> list[dict[str, float]]:
    """Factors of all constants at once, by a Latin hypercube: each is drawn once from each of its strata."""
    random = np.random.default_rng(seed)
    strata = np.stack([random.permutation(draws) for _ in keys], axis=1)
    shares = (strata + random.uniform(size=strata.shape)) / draws
    factors = np.round(1.0 + VARIED_BY * (2.0 * shares - 1.0), 6)
    return [dict(zip(keys, row, strict=True)) for row in factors.tolist()]


def _written(base: ParameterSet, name: str, values: Mapping[str, SourcedValue], folder: Path) -> Variant:
    header = {"name": name, "description": f"made from {base.name}", "waived": sorted(base.waived)}
    table = {"set": header} | {key: entry._asdict() for key, entry in values.items()}
    path = folder / f"{name}.toml"
    path.write_text(_toml(table), encoding="utf-8")
    return Variant(name, str(path))


def _toml(table: Mapping[str, Mapping[str, Any]]) -> str:
    """Tables of texts, numbers and lists as TOML, numbers to the bit."""
    lines = []
    for name, part in table.items():
        lines += [f"[{name}]", *(f"{key} = {_value(value)}" for key, value in part.items()), ""]
    return "\n".join(lines)


def _value(value: object) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_value(one) for one in value)}]"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
    return repr(float(value))  # type: ignore[arg-type]
