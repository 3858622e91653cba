"""Attributes of plan elements: a field of a dataclass says its name, its kind and whether it may be left out.

One table reads and writes all of them, so that what is read is written again as it was.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, auto
from typing import TYPE_CHECKING, Any, TypeVar

from protocol.flight_plans.expressions import Expression, Script, StoredIn, parse_expression, parse_script, parse_target
from protocol.flight_plans.xml_elements import FlightPlanError, Place, SourceText, XmlElement

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Record = TypeVar("Record", bound="DataclassInstance")
MAX_TEXT = 2000  # of an attribute [characters]
_KEY = "attribute"


class Kind(Enum):
    """Type of an attribute's value."""

    TEXT = auto()
    NAME = auto()  # not empty
    CHOICE = auto()  # one of the attribute's choices, in any case
    FLAG = auto()  # TRUE or FALSE
    NUMBER = auto()
    ANGLE = auto()  # degrees, or degrees, minutes and seconds
    EXPRESSION = auto()
    EXPRESSIONS = auto()  # several, with commas between
    SCRIPT = auto()
    WAYPOINT = auto()  # the name of one
    WAYPOINTS = auto()  # several, with commas or blanks between
    BLOCK = auto()  # the name of one
    TARGET = auto()  # what a value is stored in


@dataclass(frozen=True, slots=True)
class Attribute:
    """Attribute of a flight plan file that holds one field."""

    kind: Kind
    name: str = ""  # empty: that of the field
    is_required: bool = False
    choices: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class NameUse:
    """A name that an attribute refers to."""

    name: str
    place: Place = dataclasses.field(compare=False)

    def __str__(self) -> str:
        return self.name


def attribute(  # a field of any type: mypy sees only what its annotation says
    kind: Kind,
    *,
    name: str = "",
    default: object = None,
    choices: tuple[str, ...] = (),
) -> Any:  # noqa: ANN401
    """A field that may be left out of the file."""
    return dataclasses.field(default=default, metadata={_KEY: Attribute(kind, name, choices=choices)})


def required(kind: Kind, *, name: str = "") -> Any:  # noqa: ANN401
    """A field that the file must hold."""
    return dataclasses.field(metadata={_KEY: Attribute(kind, name, is_required=True)})


def read_attributes(record: type[Record], element: XmlElement) -> dict[str, Any]:
    """The fields of a dataclass that an element's attributes give.

    Raises:
        FlightPlanError: One is missing, unknown or not valid.
    """
    for unknown in unknown_attributes(record, element):
        names = ", ".join(_names(record))
        raise FlightPlanError(unknown.place, f"<{element.tag}> has no attribute {unknown.name!r}: {names}")
    return known_attributes(record, element)


def unknown_attributes(record: type[Record], element: XmlElement) -> tuple[NameUse, ...]:
    """The attributes of an element that no field is for."""
    names = _names(record)
    return tuple(NameUse(name, source.place) for name, source in element.attributes.items() if name not in names)


def _names(record: type[Record]) -> Mapping[str, str]:
    """Fields by the names of their attributes."""
    return {about.name or field: field for field, about in _attributes(record)}


def known_attributes(record: type[Record], element: XmlElement) -> dict[str, Any]:
    """The fields of a dataclass that an element's attributes give, whatever else it has.

    Raises:
        FlightPlanError: One is missing or not valid.
    """
    known, names = dict(_attributes(record)), _names(record)
    values = {}
    for name, field in names.items():
        if name in element.attributes:
            values[field] = _read(known[field], name, element.attributes[name])
        elif known[field].is_required:
            raise FlightPlanError(element.place, f"<{element.tag}> needs the attribute {name!r}")
    return values


def attribute_texts(record: DataclassInstance) -> dict[str, str]:
    """The attributes of a dataclass as they are written, without those that are left out."""
    texts = {}
    defaults = {field.name: field.default for field in dataclasses.fields(record)}
    for field, about in _attributes(type(record)):
        value, default = getattr(record, field), defaults[field]
        if value is not None and (about.is_required or value != default):
            texts[about.name or field] = _written(value)
    return texts


def _attributes(record: type[Any]) -> list[tuple[str, Attribute]]:
    absent = getattr(record, "absent", ())
    fields = [field for field in dataclasses.fields(record) if field.name not in absent]
    return [(field.name, field.metadata[_KEY]) for field in fields if _KEY in field.metadata]


def _written(value: object) -> str:
    match value:
        case bool():
            return "TRUE" if value else "FALSE"
        case float():
            return f"{value:.0f}" if value == round(value) and abs(value) < 1e15 else repr(value)
        case Expression() | Script() | StoredIn():
            return value.text
        case tuple():
            return ",".join(map(_written, value))
        case NameUse():
            return value.name
        case _:
            return str(value)


def _read(about: Attribute, name: str, source: SourceText) -> object:
    if len(source.text) > MAX_TEXT and about.kind is not Kind.SCRIPT:
        raise FlightPlanError(source.place, f"{name} is longer than {MAX_TEXT} characters")
    if about.kind is Kind.CHOICE:
        return _choice(about.choices, name, source)
    return _READERS[about.kind](name, source)


def _text(name: str, source: SourceText) -> str:  # noqa: ARG001 - readers are called alike
    return source.text


def _name(name: str, source: SourceText) -> str:
    text = source.text.strip()
    if not text or any(ord(c) < 32 for c in text):
        raise FlightPlanError(source.place, f"{name} {source.text!r} is not a name")
    return text


def _name_use(name: str, source: SourceText) -> NameUse:
    return NameUse(_name(name, source), source.place)


def _choice(choices: tuple[str, ...], name: str, source: SourceText) -> str:
    for choice in choices:
        if source.text.strip().lower() == choice.lower():
            return choice
    raise FlightPlanError(source.place, f"{name} {source.text[:40]!r} is not one of {', '.join(choices)}")


def _flag(name: str, source: SourceText) -> bool:
    text = source.text.strip().lower()
    if text not in {"true", "false", "1", "0"}:
        raise FlightPlanError(source.place, f"{name} {source.text[:40]!r} is neither TRUE nor FALSE")
    return text in {"true", "1"}


def _decimal(name: str, text: str, place: Place) -> float:
    plain = re.fullmatch(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?[fF]?\s*", text)
    value = float(text.strip().rstrip("fF")) if plain else math.nan
    if not math.isfinite(value):
        raise FlightPlanError(place, f"{name} {text[:40]!r} is not a number")
    return value


def _number(name: str, source: SourceText) -> float:
    return _decimal(name, source.text, source.place)


def _angle(name: str, source: SourceText) -> float:
    """Degrees; "d m s" counts with the sign of d."""
    parts = source.text.split()
    if len(parts) not in {1, 2, 3}:
        raise FlightPlanError(source.place, f"{name} {source.text[:40]!r} is neither degrees nor 'd m s'")
    values = [_decimal(name, part, source.place) for part in parts]
    if any(not 0.0 <= value < 60.0 for value in values[1:]):
        raise FlightPlanError(source.place, f"{name} {source.text[:40]!r}: minutes and seconds are from 0 to 60")
    size = abs(values[0]) + sum(value / 60.0**power for power, value in enumerate(values[1:], 1))
    return math.copysign(size, -1.0 if parts[0].startswith("-") else 1.0)


def _expression(name: str, source: SourceText) -> Expression:  # noqa: ARG001
    return parse_expression(source)


def _target(name: str, source: SourceText) -> StoredIn:  # noqa: ARG001
    return parse_target(source)


def _script(name: str, source: SourceText) -> Script:  # noqa: ARG001
    return parse_script(source)


def _parts(source: SourceText) -> list[SourceText]:
    """The parts between commas that no parentheses enclose."""
    parts, begins, depth = [], 0, 0
    for index, character in enumerate(source.text + ","):
        depth += {"(": 1, ")": -1}.get(character, 0)
        if character == "," and depth <= 0:
            text = source.text[begins:index]
            parts.append(SourceText(text, source.at(begins), text))
            begins = index + 1
    return parts or [source]


def _expressions(name: str, source: SourceText) -> tuple[Expression, ...]:  # noqa: ARG001
    return tuple(map(parse_expression, _parts(source)))


def _name_list(name: str, source: SourceText) -> tuple[NameUse, ...]:
    """Names with commas or blanks between them."""
    found = tuple(NameUse(m.group(), source.at(m.start())) for m in re.finditer(r"[^,\s]+", source.text))
    if not found:
        raise FlightPlanError(source.place, f"{name} is empty")
    return found


_READERS: Mapping[Kind, Callable[[str, SourceText], Any]] = {
    Kind.TEXT: _text,
    Kind.NAME: _name,
    Kind.FLAG: _flag,
    Kind.NUMBER: _number,
    Kind.ANGLE: _angle,
    Kind.EXPRESSION: _expression,
    Kind.EXPRESSIONS: _expressions,
    Kind.SCRIPT: _script,
    Kind.WAYPOINT: _name_use,
    Kind.WAYPOINTS: _name_list,
    Kind.BLOCK: _name_use,
    Kind.TARGET: _target,
}
