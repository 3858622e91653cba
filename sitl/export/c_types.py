"""Kinds of values of the compiled language, and their C: numbers, structs for NamedTuples, arrays of known shape."""

from __future__ import annotations

import inspect
import io
import tokenize
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from typing import Any, TypeAlias, get_args, get_origin, get_type_hints

import numpy as np

from sitl.errors import SitlError

PREFIX = "Darko"
WIDTH = 120  # of a line
BY_POINTER_FROM = 9  # numbers in a struct that is passed by pointer; smaller ones are passed by value
_C_WORDS = (
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true "
    "false sqrt fabs"
)
RESERVED = frozenset(_C_WORDS.split())


class ExportError(SitlError):
    """Something of the source has no C; it says where."""


@dataclass(frozen=True)
class ArrayKind:
    """An array of a shape, of numbers or of structs; of unknown shape in a type hint."""

    shape: tuple[int, ...] = ()
    of: Any = float


@dataclass(frozen=True)
class TupleKind:
    """A plain tuple."""

    parts: tuple[Any, ...]


Kind: TypeAlias = Any  # float, int, bool, None, a NamedTuple's class, ArrayKind or TupleKind


def kind_of(hint: Any) -> Kind:  # noqa: ANN401 - any annotation
    """The kind that an annotation stands for.

    Raises:
        ExportError: If there is none.
    """
    if hint in {float, int, bool, type(None)} or is_named(hint):
        return hint
    if hint is None:
        return type(None)
    if get_origin(hint) is tuple:
        return TupleKind(tuple(kind_of(part) for part in get_args(hint)))
    if get_origin(hint) is np.ndarray:
        return ArrayKind()
    raise ExportError(f"{hint!r} has no C type")


def is_named(kind: Any) -> bool:  # noqa: ANN401
    """Whether it is a NamedTuple."""
    return isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields")


def identifier(name: str) -> str:
    """A Python name as one of C."""
    return f"{name}_" if name in RESERVED else name


class Types:
    """Structs of one export: their C names, fields and declarations.

    Args:
        design: A value whose arrays tell the shapes of the fields that hold them; see also :meth:`learn`.
        single: Whether numbers are floats instead of doubles.
        instead: NamedTuples that stand for others of the same name.
    """

    def __init__(self, design: Any, single: bool, instead: Mapping[type, type]) -> None:  # noqa: ANN401
        self.single = single
        self.real = "float" if single else "double"
        self._instead = dict(instead)
        self._shapes: dict[tuple[type, str], tuple[int, ...]] = {}
        self._names: dict[str, Kind] = {}
        self._views: set[type] = set()
        self.learn(design)

    def learn(self, value: Any) -> None:  # noqa: ANN401 - a NamedTuple
        """Take the shapes of the arrays that a value holds.

        Raises:
            ExportError: If another value had arrays of other shapes there.
        """
        for name, part in zip(value._fields, value, strict=True):
            if isinstance(part, np.ndarray):
                self._learn_shape(type(value), name, part.shape)
            elif is_named(type(part)):
                self.learn(part)

    def _learn_shape(self, kind: type, name: str, shape: tuple[int, ...]) -> None:
        if self._shapes.setdefault((kind, name), shape) != shape:
            raise ExportError(f"{kind.__name__}.{name} has arrays of two shapes")

    def learn_view(self, kind: type, shapes: Mapping[str, tuple[int, ...]]) -> bool:
        """Whether a struct of arrays that are somewhere else may be made: one that no value was learnt of."""
        if kind not in self._views and any((kind, name) in self._shapes for name in shapes):
            return False
        self._views.add(kind)
        for name, shape in shapes.items():
            self._learn_shape(kind, name, shape)
        return True

    def is_view(self, kind: Kind) -> bool:
        """Whether a struct holds pointers to arrays that are somewhere else."""
        return isinstance(kind, type) and kind in self._views

    def resolved(self, kind: Kind) -> Kind:
        """The kind that is used for one."""
        return self._instead.get(kind, kind) if isinstance(kind, type) else kind

    def fields(self, kind: Kind) -> dict[str, Kind]:
        """Fields of a struct by their names in C."""
        kind = self.resolved(kind)
        if isinstance(kind, TupleKind):
            return {f"f{i}": self.resolved(part) for i, part in enumerate(kind.parts)}
        found = {}
        for name, hint in get_type_hints(kind).items():
            part = self.resolved(kind_of(hint))
            if isinstance(part, ArrayKind):
                if (kind, name) not in self._shapes:
                    raise ExportError(f"{kind.__name__}.{name} is an array of unknown shape")
                part = ArrayKind(self._shapes[kind, name])
            found[name] = part
        return found

    def is_struct(self, kind: Kind) -> bool:
        """Whether its C is a struct."""
        return isinstance(kind, TupleKind) or is_named(kind)

    def leaves(self, kind: Kind) -> int:
        """Count of the numbers in one."""
        if isinstance(kind, ArrayKind):
            return int(np.prod(kind.shape)) * self.leaves(kind.of)
        return sum(self.leaves(part) for part in self.fields(kind).values()) if self.is_struct(kind) else 1

    def by_pointer(self, kind: Kind) -> bool:
        """Whether a parameter of it is a pointer."""
        return self.is_struct(kind) and self.leaves(kind) >= BY_POINTER_FROM

    def name(self, kind: Kind) -> str:
        """The C type."""
        kind = self.resolved(kind)
        plain = {float: self.real, int: "int32_t", bool: "bool", type(None): "void"}
        if kind in plain:
            return plain[kind]
        if isinstance(kind, ArrayKind):
            raise ExportError("an array is no value of its own in C")
        name = PREFIX + (_tuple_name(kind) if isinstance(kind, TupleKind) else kind.__name__)
        if name not in self._names:
            for part in self.fields(kind).values():  # those of its fields are declared before it
                if self.is_struct(part):
                    self.name(part)
            self._names[name] = kind
        elif self._names[name] != kind:
            raise ExportError(f"two NamedTuples are called {kind.__name__}: {self._names[name]!r} and {kind!r}")
        return name

    def declared(self, kind: Kind, name: str, *, const: bool = False) -> str:
        """Declaration of a variable, field or parameter; an array's is of the array itself."""
        word = "const " if const else ""
        if isinstance(kind, ArrayKind):
            return f"{word}{self.name(kind.of)} {name}" + "".join(f"[{n}]" for n in kind.shape)
        return f"{word}{self.name(kind)} {name}"

    def pointed(self, kind: ArrayKind, name: str, *, const: bool = True) -> str:
        """Declaration of a name for an array, or for a row of one, that is somewhere else."""
        rest = "".join(f"[{n}]" for n in kind.shape[1:])
        real = f"const {self.real}" if const else self.real
        return f"{real} (*{name}){rest}" if rest else f"{real} *{name}"

    def declarations(self) -> Iterator[str]:
        """Lines that declare every struct that was named, each after those it holds."""
        for name, kind in self._names.items():
            notes, text = ({}, "") if isinstance(kind, TupleKind) else (field_notes(kind), inspect.getdoc(kind) or "")
            if text and not text.startswith(f"{kind.__name__}("):
                yield f"/* {_first(text)} */"
            yield "typedef struct {"
            for field, part in self.fields(kind).items():
                note = f" /* {notes[field]} */" if field in notes else ""
                is_view = self.is_view(kind) and isinstance(part, ArrayKind)
                declared = self.pointed if is_view else self.declared
                yield f"    {declared(part, identifier(field), const=False)};{note}"
            yield f"}} {name};"
            yield ""

    def number(self, value: Any) -> str:  # noqa: ANN401
        """A literal of a number: hexadecimal, with the decimal beside, unless the decimal is exact."""
        if isinstance(value, bool | np.bool_):
            return "true" if value else "false"
        if isinstance(value, int | np.integer):
            return str(int(value))
        return real_literal(float(value), self.single)


def real_literal(value: float, single: bool) -> str:
    """A literal of a real number.

    Args:
        value: The number.
        single: Whether it is a float.
    """
    kept, suffix = (float(np.float32(value)), "f") if single else (value, "")
    if np.isnan(value) or np.isinf(value):
        word = "NAN" if np.isnan(value) else "INFINITY"
        return f"{'-' if value < 0.0 else ''}({'float' if single else 'double'}){word}"
    text = repr(value)
    if Decimal(text) == Decimal(kept) and len(text) <= 12:
        return text + suffix
    return f"{_short_hex(kept)}{suffix} /* {text} */"


def _short_hex(value: float) -> str:
    """``float.hex`` without trailing zeros."""
    mantissa, _, exponent = value.hex().partition("p")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return f"{mantissa}p{exponent}"


@cache
def field_notes(kind: type) -> dict[str, str]:
    """The comments beside a NamedTuple's fields; none where its text is not to be had."""
    try:
        source = inspect.getsource(kind)
    except (OSError, TypeError):
        return {}
    notes, name = {}, ""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.NAME and token.string in kind._fields and not token.line[: token.start[1]].strip():  # type: ignore[attr-defined]
            name = token.string
        if token.type == tokenize.COMMENT and token.line.strip().startswith(f"{name}:"):
            notes[name] = comment(token.string.lstrip("# "))
    return notes


def wrapped_line(line: str) -> str:
    """A line of C, broken outside its comments where it is too long: behind a comma if one is far enough right."""
    if len(line) <= WIDTH:
        return line
    indent = len(line) - len(line.lstrip())
    depth, at_comma, at_space = 0, -1, -1
    for i, letter in enumerate(line[: WIDTH + 1]):
        depth += line.startswith("/*", i) - line.startswith("*/", i)
        if letter == " " and depth == 0 and i > indent + 20 and line[i + 1] not in "*{/":
            at_space = i
            at_comma = i if line[i - 1] == "," else at_comma
    best = at_comma if at_comma > WIDTH // 2 else at_space
    rest = line[best + 1 :].lstrip()
    return line if best < 0 else line[:best] + "\n" + wrapped_line(" " * (indent + 4) + rest)


def comment(text: str) -> str:
    """Text that may stand in a comment of C."""
    return text.replace("*/", "* /").replace("/*", "/ *")


def _first(text: str) -> str:
    return comment(" ".join(text.split("\n\n", maxsplit=1)[0].split()))


def _tuple_name(kind: TupleKind) -> str:
    """``Real2`` of two numbers, ``Vector4`` of four vectors, else the names in a row."""
    names = [_part_name(part) for part in kind.parts]
    return f"{names[0]}{len(names)}" if len(set(names)) == 1 else "".join(names)


def _part_name(part: Kind) -> str:
    if isinstance(part, TupleKind):
        return _tuple_name(part)
    return {float: "Real", int: "Int", bool: "Bool"}.get(part) or str(part.__name__)
