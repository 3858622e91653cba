"""The exported controller behind arrays of doubles, ``darko_flat.c``: for tests and simulators, not for use aboard.

A value is flat as its numbers in the order of its fields, depth first. Flags are 0 or 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from sitl.control.estimate import Estimate, Readings
from sitl.control.reference import Reference
from sitl.export.c_types import ArrayKind, Kind, Types, identifier
from sitl.export.templates import template
from sitl.model.airframe import Array
from sitl.simulation.flight import Controller, Design
from sitl.storage import Records

# Of a row of a recorded flight, before its estimate: whether flags were asked for in it, the flags, and the readings'.
WAS_ASKED, ARMED, FLYING, LANDING, HAS_READINGS, CRASHED = range(6)
FLAGS = 6


def flat_file(types: Types, values_type: str) -> str:
    """Text of ``darko_flat.c``."""
    kinds = {"Estimate": Estimate, "Reference": Reference, "Readings": Readings, "Controller": Controller}
    text = template("darko_flat.c").replace("@flags@", str(FLAGS)).replace("@values_type@", values_type)
    copies = []
    for kind in (*kinds.values(), Design):
        copies += [*copied(types, kind, to_struct=True)]
        copies += [*copied(types, kind, to_struct=False)] if kind in {Controller, Design} else []
    for name, kind in (*kinds.items(), ("Design", Design)):
        text = text.replace(f"@{name}@", str(types.leaves(kind)))
    return text.replace("@copies@", "\n".join(copies))


def copied(types: Types, kind: Any, *, to_struct: bool) -> Iterator[str]:  # noqa: ANN401 - a NamedTuple's class
    """Lines of a function that copies a struct from a flat array, or into one.

    Args:
        types: Structs.
        kind: The struct.
        to_struct: Whether it is to be read.
    """
    c_type, word = types.name(kind), kind.__name__.lower()
    if to_struct:
        yield f"static void get_{word}({c_type} *to, const double *from) {{"
    else:
        yield f"static void put_{word}(const {c_type} *from, double *to) {{"
    for at, place, part in _places(types, kind, 0, "to->" if to_struct else "from->"):
        if isinstance(part, ArrayKind):
            n = types.leaves(part)
            own, other = (types.real, "const double") if to_struct else (f"const {types.real}", "double")
            whole = f"({own} *)" if len(part.shape) > 1 else ""
            there = f"{'from' if to_struct else 'to'} + {at}"
            yield f"    for (int32_t i = 0; i < {n}; ++i) {{"
            yield f"        {own} *mine = {whole}{place};"
            yield f"        {other} *other = {there};"
            yield f"        {f'mine[i] = ({types.real})other[i]' if to_struct else 'other[i] = (double)mine[i]'};"
            yield "    }"
        elif to_struct:
            value = {bool: f"from[{at}] > 0", int: f"(int32_t)from[{at}]", float: f"({types.real})from[{at}]"}[part]
            yield f"    {place} = {value};"
        else:
            yield f"    to[{at}] = {f'{place} ? 1.0 : 0.0' if part is bool else f'(double){place}'};"
    yield "}"
    yield ""


def record_copied(
    types: Types,
    kind: Any,  # noqa: ANN401 - a NamedTuple's class
    layout: Any,  # noqa: ANN401 - the record's type
    *,
    loads: bool,
    skipped: tuple[str, ...] = (),
) -> Iterator[str]:
    """Lines of a function that copies a struct from a record of the simulator, or into one.

    Args:
        types: Structs.
        kind: The struct, which may have fewer fields than the record.
        layout: Numpy's type of the record.
        loads: Whether the struct is to be filled.
        skipped: Fields that are left as they are.
    """
    c_type, word = types.name(kind), kind.__name__.lower()
    if loads:
        yield f"static void load_{word}({c_type} *to, const unsigned char *from) {{"
    else:
        yield f"static void store_{word}(const {c_type} *from, unsigned char *to) {{"
    for at, place, part in _record_places(types, kind, layout, 0, "to->" if loads else "from->", skipped):
        there = f"{'from' if loads else 'to'} + {at}"
        if part is int:
            yield f"    {place} = loaded_int({there});" if loads else f"    store_int({place}, {there});"
        elif part is bool:
            yield f"    {place} = from[{at}] != 0;" if loads else f"    to[{at}] = {place} ? 1 : 0;"
        else:
            n, is_row = types.leaves(part), isinstance(part, ArrayKind) and len(part.shape) == 1
            real = types.real if loads else f"const {types.real}"
            mine = place if is_row else f"({real} *){place}" if isinstance(part, ArrayKind) else f"&{place}"
            yield f"    load_reals({mine}, {there}, {n});" if loads else f"    store_reals({mine}, {there}, {n});"
    yield "}"
    yield ""


def _record_places(
    types: Types,
    kind: Kind,
    layout: Any,  # noqa: ANN401
    at: int,
    place: str,
    skipped: tuple[str, ...],
) -> Iterator[tuple[int, str, Kind]]:
    """Numbers and arrays of a struct: where each is in the record, its place, and its kind."""
    for field, part in types.fields(kind).items():
        inner, offset = layout.fields[field][:2]
        if field in skipped:
            continue
        if types.is_struct(part):
            yield from _record_places(types, part, inner, at + offset, f"{place}{identifier(field)}.", ())
        else:
            yield at + offset, f"{place}{identifier(field)}", part


def _places(types: Types, kind: Kind, at: int, place: str) -> Iterator[tuple[int, str, Kind]]:
    """Numbers and arrays of a struct: where each begins in the flat array, its place, and its kind."""
    for field, part in types.fields(kind).items():
        here = f"{place}{identifier(field)}"
        if types.is_struct(part):
            yield from _places(types, part, at, f"{here}.")
        else:
            yield at, here, part
        at += types.leaves(part)


def flattened(value: Any) -> Array:  # noqa: ANN401 - a NamedTuple, or a tuple
    """A value's numbers."""
    return np.array(list(_numbers(value)))


def _numbers(value: Any) -> Iterator[float]:  # noqa: ANN401
    for part in value:
        if isinstance(part, tuple):
            yield from _numbers(part)
        elif isinstance(part, np.ndarray):
            yield from part.ravel()
        else:
            yield float(part)


def flattened_records(records: Records) -> Array:
    """The numbers of each of n records, or of as many parts of them, (n, numbers)."""
    names = records.dtype.names
    if names is None:
        return records.reshape(len(records), -1).astype(float)
    return np.concatenate([flattened_records(records[name]) for name in names], axis=1)
