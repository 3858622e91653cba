"""Values as initialisers of C: gains, thresholds and specifications in their structs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from sitl.export.c_types import ArrayKind, Kind, Types, identifier

SPARSE_SHARE = 0.5  # arrays with more zeros than this are written without them


def initialiser(types: Types, kind: Kind, value: Any, indent: str) -> Iterator[str]:  # noqa: ANN401 - a NamedTuple
    """Lines of an initialiser, without its own brackets.

    Args:
        types: Structs.
        kind: The struct.
        value: What it is to hold.
        indent: Before each line.
    """
    for (field, part), one in zip(types.fields(kind).items(), value, strict=True):
        if types.is_struct(part):
            yield f"{indent}.{identifier(field)} = {{"
            yield from initialiser(types, part, one, indent + "    ")
            yield f"{indent}}},"
        elif isinstance(part, ArrayKind):
            yield f"{indent}.{identifier(field)} = {{"
            yield from _array(types, np.asarray(one), indent + "    ")
            yield f"{indent}}},"
        else:
            number = part(one) if part in {bool, int, float} else one
            yield f"{indent}.{identifier(field)} = {types.number(number)},"


def _array(types: Types, array: Any, indent: str) -> Iterator[str]:  # noqa: ANN401
    if not array.any() or np.mean(array == 0.0) <= SPARSE_SHARE:
        yield from _rows(types, array, indent)
        return
    for index in zip(*np.nonzero(array), strict=True):
        place = "".join(f"[{i}]" for i in index)
        yield f"{indent}{place} = {types.number(float(array[index]))},"


def _rows(types: Types, array: Any, indent: str) -> Iterator[str]:  # noqa: ANN401
    for row in array:
        if array.ndim == 1:
            yield f"{indent}{types.number(float(row))},"
        else:
            yield f"{indent}{{"
            yield from _rows(types, row, indent + "    ")
            yield f"{indent}}},"
