"""Storage of flights: records whose fields are those of the named tuples, or blocks of flights side by side.

A *record* is one numpy structured value, a field per leaf of a NamedTuple. A *block* is a float array with a row per
leaf and a column per flight, so that vector instructions take consecutive flights. What reads and writes either is
generated from the NamedTuple; no offset is written by hand, and the compiled phases of a flight are one text for both.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple, TypeAlias, TypeVar, cast, get_args, get_origin, get_type_hints

import numpy as np
from numba import types
from numba.extending import overload

from sitl.compiled import INLINED, kernel
from sitl.model.airframe import Array

Kept: TypeAlias = Any  # a record or a block, whatever compiled code is given
Named = TypeVar("Named", bound=tuple[Any, ...])

WIDTH = 16  # columns of a block
_LEAVES: dict[type, str] = {float: "f8", int: "i8", bool: "?"}


class Leaf(NamedTuple):
    """One number of a NamedTuple."""

    path: str  # such as ".body.position.x"
    kind: Any  # float, int, bool, or an array's annotation
    row: int  # in a block


@cache
def fields(kind: Any) -> dict[str, Any]:  # noqa: ANN401 - a NamedTuple, or a tuple's annotation
    """Names and types of the parts; those of a plain tuple are f0, f1 and so on."""
    if get_origin(kind) is tuple:
        return {f"f{i}": part for i, part in enumerate(get_args(kind))}
    return get_type_hints(kind)


def _is_compound(kind: Any) -> bool:  # noqa: ANN401
    return get_origin(kind) is tuple or (isinstance(kind, type) and issubclass(kind, tuple))


def leaves(kind: Any, path: str = "", first: int = 0) -> Iterator[Leaf]:  # noqa: ANN401
    """All leaves, in order."""
    if not _is_compound(kind):
        yield Leaf(path, kind, first)
        return
    for name, part in fields(kind).items():
        inside = list(leaves(part, f"{path}.{name}", first))
        first += len(inside)
        yield from inside


def record_type(kind: Any, value: Any = None) -> np.dtype[Any]:  # noqa: ANN401
    """The structured type that holds one value of a NamedTuple.

    Args:
        kind: The NamedTuple.
        value: An example, which tells the shapes of its arrays; not needed where there are none.
    """
    return _plain_type(kind) if value is None else _typed(kind, value)


@cache
def _plain_type(kind: Any) -> np.dtype[Any]:  # noqa: ANN401
    return _typed(kind, None)


def _typed(kind: Any, value: Any) -> np.dtype[Any]:  # noqa: ANN401
    parts: list[Any] = []
    for i, (name, part) in enumerate(fields(kind).items()):
        example = None if value is None else value[i]
        if _is_compound(part):
            parts.append((name, _typed(part, example)))
        elif part in _LEAVES:
            parts.append((name, _LEAVES[part]))
        else:
            parts.append((name, "f8", np.shape(example if example is not None else 0.0)))
    return np.dtype((np.record, parts))


def record_of(kind: type, value: tuple[Any, ...]) -> np.ndarray[Any, Any]:
    """A value as an array of one record."""
    record = np.zeros(1, record_type(kind, value))
    record[0] = value
    return record


def block_of(values: Sequence[tuple[Any, ...]]) -> Array:
    """A block of WIDTH values, flat."""
    return np.ascontiguousarray(np.array([column(value) for value in values]).T).reshape(-1)


def from_block(kind: type[Named], block: Array, index: int) -> Named:
    """One value of a block."""
    return from_column(kind, block[index::WIDTH])


def column_rows(kind: type, *paths: str) -> tuple[int, ...]:
    """Rows of single leaves in a block, by paths such as ``plant.body.position.z``."""
    rows = {leaf.path[1:]: leaf.row for leaf in leaves(kind)}
    return tuple(rows[path] for path in paths)


def column(value: tuple[Any, ...]) -> list[float]:
    """A value's leaves as a block's column."""
    return [number for part in value for number in (column(part) if isinstance(part, tuple) else (float(part),))]


def from_column(kind: type[Named], numbers: Array) -> Named:
    """The value of a block's column."""
    return cast("Named", _maker(kind, nested=False)(numbers.tolist()))


def named_from(kind: type[Named], row: tuple[Any, ...]) -> Named:
    """The NamedTuple of a record's plain nested tuple (``record.item()``)."""
    return cast("Named", _maker(kind, nested=True)(row))


@cache
def _maker(kind: type[Named], *, nested: bool) -> Callable[[Any], Named]:
    """A function that builds the NamedTuple of nested tuples, or of the numbers of all leaves."""
    scope: dict[str, Any] = {}
    rows = itertools.count()

    def made(part: Any, at: str) -> str:  # noqa: ANN401
        if part in _LEAVES:
            scope[part.__name__] = part
            return at if nested else f"{part.__name__}(row[{next(rows)}])"
        inside = [made(inner, f"{at}[{i}]") for i, inner in enumerate(fields(part).values())]
        if get_origin(part) is tuple:
            return f"({', '.join(inside)},)"
        return f"{_name_in(scope, part)}({', '.join(inside)})"

    source = f"def make(row):\n    return {made(kind, 'row')}\n"
    exec(compile(source, "<maker>", "exec"), scope)  # noqa: S102 - made above from field names
    return scope["make"]  # type: ignore[no-any-return]


def _name_in(scope: dict[str, Any], kind: type) -> str:
    """The name of a type in generated code, where another may be called the same."""
    known = next((name for name, other in scope.items() if other is kind), None)
    name = known or f"{kind.__name__}_{len(scope)}"
    scope[name] = kind
    return name


def zero(kind: type[Named]) -> Named:
    """The NamedTuple with every number zero and every flag down."""
    parts = [part() if part in _LEAVES else zero(part) for part in fields(kind).values()]
    return tuple(parts) if get_origin(kind) is tuple else kind(*parts)  # type: ignore[return-value]


class Access(NamedTuple):
    """Compiled reading and writing of one part of a kept NamedTuple."""

    get: Callable[..., Any]  # (record or block, column) -> value
    put: Callable[..., None]  # (record or block, column, value)


@cache  # everyone shares what is compiled for one part
def access(root: type, path: str = "") -> Access:
    """Reading and writing of the part of ``root`` at a path such as ``plant.body``; all of it without one.

    Both take a record or a block, and the block's column, which a record does not look at.
    """
    kind: Any = root
    for name in path.split(".") if path else ():
        kind = fields(kind)[name]
    where = f".{path}" if path else ""
    rows = _rows(root)
    inside = [Leaf(leaf.path, leaf.kind, rows[where + leaf.path]) for leaf in leaves(kind)]
    scope: dict[str, Any] = {}
    place = f"kept{_keyed(where)}"
    parts: list[str] = []
    of_record = _read(kind, place, scope, parts)
    of_block = _expression(kind, "", scope, {leaf.path: leaf.row for leaf in inside})
    get = _chosen([*parts, f"return {of_record}"], [f"return {of_block}"], "kept, column", scope)
    stored = [f"kept[{leaf.row * WIDTH} + column] = value{_indexed(kind, leaf.path)}" for leaf in inside]
    return Access(get, _chosen(_written(kind, place, "value"), stored, "kept, column, value", scope))


@cache
def _rows(root: type) -> dict[str, int]:
    return {leaf.path: leaf.row for leaf in leaves(root)}


def _keyed(path: str) -> str:
    """The path within a record: by keys, since ``record.size`` and the like are numpy's own."""
    return "".join(f'["{name}"]' for name in path.split(".")[1:])


def _indexed(kind: Any, path: str) -> str:  # noqa: ANN401
    """The path within a value, plain tuples by index."""
    said = ""
    for name in path.split(".")[1:]:
        is_plain = get_origin(kind) is tuple
        said += f"[{name[1:]}]" if is_plain else f".{name}"
        kind = fields(kind)[name]
    return said


def _read(kind: Any, place: str, scope: dict[str, Any], parts: list[str]) -> str:  # noqa: ANN401
    """The value at a place in a record; adds a line to ``parts`` for every part of it, so that none is sought twice."""
    if not _is_compound(kind):
        return place
    part = f"part_{len(parts)}"
    parts.append(f"{part} = {place}")
    inside = [_read(inner, f'{part}["{name}"]', scope, parts) for name, inner in fields(kind).items()]
    return _made_of(kind, inside, scope)


def _written(kind: Any, place: str, value: str) -> list[str]:  # noqa: ANN401
    """Lines that put a value at a place in a record."""
    if not _is_compound(kind):
        return [f"{place} = {value}"]
    is_plain = get_origin(kind) is tuple
    part = "part_" + "".join(letter if letter.isalnum() else "_" for letter in place)
    lines = [f"{part} = {place}"]
    for i, (name, inner) in enumerate(fields(kind).items()):
        lines += _written(inner, f'{part}["{name}"]', f"{value}[{i}]" if is_plain else f"{value}.{name}")
    return lines


def _expression(kind: Any, path: str, scope: dict[str, Any], rows: dict[str, int]) -> str:  # noqa: ANN401
    """The value in a block's column."""
    if not _is_compound(kind):
        number = f"kept[{rows[path] * WIDTH} + column]"
        return f"{number} != 0.0" if kind is bool else f"int({number})" if kind is int else number
    parts = [_expression(part, f"{path}.{name}", scope, rows) for name, part in fields(kind).items()]
    return _made_of(kind, parts, scope)


def _made_of(kind: Any, parts: list[str], scope: dict[str, Any]) -> str:  # noqa: ANN401
    if get_origin(kind) is tuple:
        return f"({', '.join(parts)},)"
    return f"{_name_in(scope, kind)}({', '.join(parts)})"


def _chosen(of_record: list[str], of_block: list[str], arguments: str, scope: dict[str, Any]) -> Callable[..., Any]:
    """A function whose lines depend on what it is given, in compiled code and in Python."""

    def made(lines: list[str]) -> Callable[..., Any]:
        names = dict(scope)
        body = "\n    ".join(lines)
        exec(compile(f"def made({arguments}):\n    {body}\n", "<access>", "exec"), names)  # noqa: S102 - made above
        return names["made"]  # type: ignore[no-any-return]

    in_record, in_block = made(of_record), made(of_block)
    names: dict[str, Any] = {"in_record": in_record, "in_block": in_block, "ndarray": np.ndarray}
    body = f"return in_block({arguments}) if isinstance(kept, ndarray) else in_record({arguments})"
    exec(compile(f"def either({arguments}):\n    {body}\n", "<access>", "exec"), names)  # noqa: S102
    either = names["either"]

    def choose(kept: Any, *rest: Any) -> Callable[..., Any]:  # noqa: ANN401, ARG001
        return in_record if isinstance(kept, types.Record) else in_block

    choosing = f"def choosing({arguments}):\n    return choose(kept)\n"
    names["choose"] = choose
    exec(compile(choosing, "<access>", "exec"), names)  # noqa: S102
    register = overload(either, jit_options=INLINED, strict=False)  # type: ignore[arg-type]
    register(names["choosing"])
    return either  # type: ignore[no-any-return]


def replacing(kind: type[Named], name: str) -> Callable[[Named, Any], Named]:
    """A function that gives a NamedTuple with one field replaced; to compiled code a constant stays one."""
    scope: dict[str, Any] = {}
    parts = ", ".join("new" if field == name else f"value.{field}" for field in fields(kind))
    source = f"def replaced(value, new):\n    return {_name_in(scope, kind)}({parts})\n"
    exec(compile(source, "<replacing>", "exec"), scope)  # noqa: S102 - made above from field names
    return kernel(scope["replaced"])
