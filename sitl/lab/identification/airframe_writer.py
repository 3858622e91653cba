"""An identified airframe as a file that ``--airframe`` takes."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TypeAlias

from sitl import SitlError, load_airframe
from sitl.lab.identification.result import Identification
from sitl.lab.identification.unknowns import ADVANCE, value_of
from sitl.model.airframe_files import ALL_UNITS, PROPELLER_KEYS, RULES, ParameterSet, available
from sitl.model.propeller_files import PropellerError, PropellerFactors, load_propeller

Entries: TypeAlias = dict[str, tuple[float | str, str]]  # values and sources by key of the file

FILE_DIGITS = 6
TORQUE_STEP = 1.02
FACTOR_OF = dict(zip(("k_f", "k_m", ADVANCE, "S_p"), PropellerFactors._fields, strict=True))


def write_airframe(
    found: Identification, base: ParameterSet, known: Mapping[str, float], flight: str, path: Path
) -> None:
    """Write the file and see that it loads.

    Args:
        found: What was identified.
        base: The set it began from; a set of a file of its own is written in full.
        known: What the user told, by field.
        flight: Name of the log, for the sources.
        path: Of the file.

    Raises:
        SitlError: It cannot be written, or no vehicle could fly on it.
    """
    shipped = base.name in available() and load_airframe(base.name).sha256 == base.sha256
    told = dict(_told(found, known, flight))
    entries: Entries = {} if shipped else {key: (base.values[key].value, base.values[key].source) for key in _own(base)}
    for key, (number, source) in told.items():
        entries |= dict([_entry(base, key, number, source)])
    entries |= _sparing(base, entries)
    waived = sorted(base.waived | {name for name, rule in RULES.items() if not rule.holds(found.airframe)})
    lines = ["# Identified. A set with a base takes from it what it does not state itself.", "[set]"]
    lines += [f"name = {_text(path.stem)}", f"description = {_text(f'{base.name} as identified from {flight}')}"]
    lines += [f"base = {_text(base.name)}"] if shipped else []
    lines += [f"waived = {json.dumps(waived)}"] if waived else []
    for key, (value, source) in entries.items():
        shown = _text(value) if isinstance(value, str) else repr(value)
        lines += ["", f"[{key}]", f"value = {shown}", f"unit = {_text(ALL_UNITS[key])}", f"source = {_text(source)}"]
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise SitlError(f"{path}: cannot be written: {error.strerror}") from error
    load_airframe(str(path))


def _own(base: ParameterSet) -> list[str]:
    """Keys of a set that a file without a base states: of a propeller not what its own file does."""
    return [key for key in base.values if key not in PROPELLER_KEYS or "propeller" not in base.values]


def _told(found: Identification, known: Mapping[str, float], flight: str) -> Iterator[tuple[str, tuple[float, str]]]:
    for key, value in known.items():
        yield key, (value, "given by the user")
    for row in found.parameters:
        share = 100.0 * row.interval / abs(row.estimate) if row.estimate else math.inf
        how = f"within {share:.2g} % (95 %)" if row.told else "which hardly tells it: near the set's value"
        yield row.key, (row.estimate, f"identified from {flight}, {how}")


def _sparing(base: ParameterSet, entries: Entries) -> Entries:
    """The torque factor that is needed for the propeller to take more power than it gives, if it is larger."""
    if "propeller" not in base.values:
        return {}
    stated = {key: one.value for key, one in base.values.items()} | {key: value for key, (value, _) in entries.items()}
    factors = PropellerFactors(**{key: float(stated[key]) for key in PropellerFactors._fields if key in stated})
    propeller, least = load_propeller(str(stated["propeller"])), factors.torque_factor
    while True:
        try:
            propeller.corrected(factors)
        except PropellerError:
            factors = factors._replace(torque_factor=_rounded(TORQUE_STEP * factors.torque_factor))
        else:
            break
    if factors.torque_factor == least:
        return {}
    source = f"raised from {least:g}, with which the propeller would give more power than it takes"
    return {"torque_factor": (factors.torque_factor, source)}


def _entry(base: ParameterSet, key: str, value: float, source: str) -> tuple[str, tuple[float | str, str]]:
    """A constant of the kernels as the file states it."""
    if "propeller" in base.values and key in FACTOR_OF:
        factor = FACTOR_OF[key]
        before = float(base.values[factor].value) if factor in base.values else 1.0
        return factor, (_rounded(before * value / value_of(base.parameters, key)), source)
    if key == "per_stall":
        return "stall_angle", (_rounded(math.degrees(math.asin(min(value**-0.5, 1.0)))), source)
    shown = math.degrees(value) if ALL_UNITS[key] == "deg" else value
    return key, (_rounded(shown), source)


def _rounded(value: float) -> float:
    return float(f"{value:.{FILE_DIGITS}g}")


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
