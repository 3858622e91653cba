"""Records: numpy structured values whose fields are those of a NamedTuple, which compiled code changes in place.

A record is annotated as the NamedTuple that it holds, and its numbers are read by the same attributes:
``flight.controller.law``. A part that is itself a NamedTuple is a view: :func:`value_of` copies it into named values,
and what :func:`writer` makes puts values back. No offset is written by hand.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar, cast, get_args, get_origin, get_type_hints

import numpy as np
import numpy.typing as npt
from numba import from_dtype, types
from numba.extending import overload

from sitl.compiled import INLINED, kernel

Records = npt.NDArray[Any]  # an array of records, (n,)
Named = TypeVar("Named", bound=tuple[Any, ...])
Part = TypeVar("Part")
_LEAVES: dict[type, str] = {float: "f8", int: "i8", bool: "?"}
_WRITTEN: dict[Callable[..., Any], tuple[str, ...]] = {}  # paths by the writers
_REPLACED: dict[Callable[..., Any], str] = {}  # fields by what gives a value with another one in it
_KINDS: dict[Any, list[Any]] = {}  # NamedTuples by the types of their records, numpy's and numba's


@cache
def fields(kind: Any) -> dict[str, Any]:  # noqa: ANN401 - a NamedTuple, or a tuple's annotation
    """Names and types of the parts; those of a plain tuple are f0, f1 and so on."""
    if get_origin(kind) is tuple:
        return {f"f{i}": part for i, part in enumerate(get_args(kind))}
    return get_type_hints(kind)


@cache
def is_compound(kind: Any) -> bool:  # noqa: ANN401
    """Whether a part consists of others."""
    return get_origin(kind) is tuple or (isinstance(kind, type) and issubclass(kind, tuple))


def record_type(kind: Any, value: Any = None) -> np.dtype[Any]:  # noqa: ANN401
    """The structured type that holds one value of a NamedTuple.

    Args:
        kind: The NamedTuple.
        value: An example, which tells the shapes of its arrays; not needed where there are none.
    """
    return _typed(kind, None if value is None else _shapes(kind, value))


def _shapes(kind: Any, value: Any) -> tuple[Any, ...]:  # noqa: ANN401
    """Shapes of the arrays of an example, in tuples as its parts are; None for a number."""
    return tuple(
        _shapes(part, value[i]) if is_compound(part) else None if part in _LEAVES else np.shape(value[i])
        for i, part in enumerate(fields(kind).values())
    )


@cache  # numba makes its own type of each, which takes twenty milliseconds for the filter's
def _typed(kind: Any, shapes: tuple[Any, ...] | None) -> np.dtype[Any]:  # noqa: ANN401
    parts: list[Any] = []
    for i, (name, part) in enumerate(fields(kind).items()):
        shape = None if shapes is None else shapes[i]
        if is_compound(part):
            parts.append((name, _typed(part, shape)))
        elif part in _LEAVES:
            parts.append((name, _LEAVES[part]))
        else:
            parts.append((name, "f8", shape or ()))
    made = np.dtype((np.record, parts))
    _remember(kind, made)
    return made


def _remember(kind: Any, made: np.dtype[Any]) -> None:  # noqa: ANN401
    """Note what a record of this type is read as."""
    for key in (made, from_dtype(made)):
        known = _KINDS.setdefault(key, [])
        if all(kind.__name__ != other.__name__ for other in known):
            known.append(kind)


def _kind_of(key: Any) -> Any:  # noqa: ANN401
    """The NamedTuple of a record's type.

    Raises:
        TypeError: If several have the same fields: only what holds such a part can be read.
    """
    first, *others = _KINDS[key]
    if others:
        raise TypeError(f"{first.__name__} and {others[0].__name__} have the same fields: read what holds them")
    return first


def record_of(kind: type, value: tuple[Any, ...]) -> Records:
    """A value as an array of one record."""
    record = np.zeros(1, record_type(kind, value))
    record[0] = value
    return record


def named_from(kind: type[Named], row: tuple[Any, ...]) -> Named:
    """The NamedTuple of a record's plain nested tuple (``record.item()``)."""
    return cast("Named", _builder(kind)(row))


@cache
def _builder(kind: type[Named]) -> Callable[[Any], Named]:
    """A function that builds the NamedTuple of nested tuples."""
    scope: dict[str, Any] = {}

    def built(part: Any, at: str) -> str:  # noqa: ANN401
        if not is_compound(part):
            return at
        return _call(part, [built(inner, f"{at}[{i}]") for i, inner in enumerate(fields(part).values())], scope)

    return _function("build(row)", [f"return {built(kind, 'row')}"], scope)


def zero(kind: type[Named]) -> Named:
    """The NamedTuple with every number zero and every flag down."""
    parts = [part() if part in _LEAVES else zero(part) for part in fields(kind).values()]
    return tuple(parts) if get_origin(kind) is tuple else kind(*parts)  # type: ignore[return-value]


def value_of(part: Named) -> Named:
    """The named values of a record or of a part of one; anything else as it is."""
    kept: Any = getattr(part, "dtype", None)
    return cast("Named", _loader(_kind_of(kept))(part)) if kept in _KINDS else part


def copy_of(part: Named) -> Named:
    """The named values of a record or of a part of one, in Python's own numbers, for what is not compiled."""
    record: Any = part
    return cast("Named", named_from(_kind_of(record.dtype), record.item()))


@overload(value_of, jit_options=INLINED, strict=False)  # type: ignore[arg-type]
def _value_of(part: Any) -> Callable[[Any], Any]:  # noqa: ANN401
    return _loader(_kind_of(part)) if isinstance(part, types.Record) else lambda part: part


@cache
def _loader(kind: Any) -> Callable[[Any], Any]:  # noqa: ANN401
    """A function that reads a record field by field."""
    scope: dict[str, Any] = {}
    lines: list[str] = []

    def read(part: Any, place: str) -> str:  # noqa: ANN401
        """The value at a place; a line for every part on the way, so that none is sought twice."""
        if not is_compound(part):
            return place
        name = f"part_{len(lines)}"
        lines.append(f"{name} = {place}")
        return _call(part, [read(inner, f'{name}["{field}"]') for field, inner in fields(part).items()], scope)

    value = read(kind, "part")
    return _function("value(part)", [*lines, f"return {value}"], scope)


class _Path:
    """Stands for a record while a part of it is named by attributes."""

    def __init__(self, names: tuple[str, ...] = ()) -> None:
        self.names = names

    def __getattr__(self, name: str) -> _Path:
        return _Path((*self.names, name))


def writer(kind: type[Named], part: Callable[[Named], Part]) -> Callable[[Named, Part], None]:
    """A compiled function that puts a value in the place of a record's part.

    Args:
        kind: NamedTuple of the record.
        part: Names the part by attributes, such as ``lambda flight: flight.plant.body``.
    """
    path: Any = part(cast("Any", _Path()))
    return writer_at(kind, path.names)


@cache
def writer_at(kind: type, names: tuple[str, ...]) -> Callable[[Any, Any], None]:
    """The same, of the part at a path of field names; all of the record where there are none."""
    inner: Any = kind
    for name in names:
        inner = fields(inner)[name]
    place = "record" + "".join(f'["{name}"]' for name in names)
    write = kernel(_function("write(record, value)", _written(inner, place, "value"), {}))
    _WRITTEN[write] = names
    return write


def path_written(function: Callable[..., Any]) -> tuple[str, ...] | None:
    """Field names of the place that a writer puts its value in; None of another function."""
    return _WRITTEN.get(function)


def _written(kind: Any, place: str, value: str) -> list[str]:  # noqa: ANN401
    """Lines that put a value at a place in a record."""
    if not is_compound(kind):
        return [f"{place} = {value}"]
    is_plain = get_origin(kind) is tuple
    part = "part_" + "".join(letter if letter.isalnum() else "_" for letter in place)
    lines = [f"{part} = {place}"]
    for i, (name, inner) in enumerate(fields(kind).items()):
        lines += _written(inner, f'{part}["{name}"]', f"{value}[{i}]" if is_plain else f"{value}.{name}")
    return lines


def replacing(kind: type[Named], name: str) -> Callable[[Named, Any], Named]:
    """A function that gives a NamedTuple with one field replaced; to compiled code a constant stays one."""
    scope: dict[str, Any] = {}
    parts = ["new" if field == name else f"value.{field}" for field in fields(kind)]
    replaced = kernel(_function("replaced(value, new)", [f"return {_call(kind, parts, scope)}"], scope))
    _REPLACED[replaced] = name
    return replaced


def field_replaced(function: Callable[..., Any]) -> str | None:
    """The field that a function of :func:`replacing` replaces; None of another function."""
    return _REPLACED.get(function)


def _call(kind: Any, arguments: list[str], scope: dict[str, Any]) -> str:  # noqa: ANN401
    """Text of the making of a NamedTuple, or of a plain tuple."""
    if get_origin(kind) is tuple:
        return f"({', '.join(arguments)},)"
    known = next((name for name, other in scope.items() if other is kind), None)
    name = known or f"{kind.__name__}_{len(scope)}"  # where another may be called the same
    scope[name] = kind
    return f"{name}({', '.join(arguments)})"


def _function(head: str, lines: list[str], scope: dict[str, Any]) -> Callable[..., Any]:
    """A function of generated text."""
    source = f"def {head}:\n    " + "\n    ".join(lines) + "\n"
    exec(compile(source, f"<{head}>", "exec"), scope)  # noqa: S102 - made from field names
    return scope[head.split("(", maxsplit=1)[0]]  # type: ignore[no-any-return]
