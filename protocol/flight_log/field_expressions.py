"""Quantities of a log, or of messages as they arrive: ``ATTITUDE.roll``, ``deg(DARKO_ACTUATORS.elevon[0])``.

Numbers, fields of messages, with an index where they are arrays, names of PANEL_NAMES, + - * / ** and brackets, the
constants ``pi`` and ``g`` and the functions of FIELD_FUNCTIONS; ``^`` is ``**``. Where messages meet, all are taken at
the times of the one that comes first in the text: measured values in proportion, angles on the circle, codes as told
last.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Collection, Mapping
from difflib import get_close_matches
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from protocol.errors import FileError, LocalProtocolError
from protocol.tlog import TlogReader
from protocol.tlog.message_set import message_named
from protocol.wire.message import Source

Floats = NDArray[np.float64]

MIN_GAP = 2.0  # [s] a shorter silence is none
HELD = 0.0  # in place of a whole turn: what has no value between two
TURNS = {  # units of angles, and a whole turn in them
    "rad": 2.0 * np.pi, "mrad": 2e3 * np.pi, "deg": 360.0, "deg/2": 180.0, "ddeg": 3.6e3, "cdeg": 3.6e4, "degE5": 3.6e7,
    "degE7": 3.6e9,
}  # fmt: skip
USUAL_STEPS = 5.0  # of the usual time between two messages: a longer silence is a gap


def longest_step(times: Floats) -> float:
    """Time between two neighbours from which on there is a gap [s]; ``times`` ascend."""
    steps = np.diff(times)
    return max(MIN_GAP, USUAL_STEPS * float(np.median(steps))) if len(steps) else MIN_GAP


def between(wanted: Floats, times: Floats, values: Floats, turn: float | None = None) -> Floats:
    """Values at other times; NaN in gaps, and as far outside.

    Args:
        wanted: Times [s], shape (n,).
        times: Of the values [s], ascending, shape (m,).
        values: Shape (m,).
        turn: None: in between in proportion; HELD: the last value stays; else a whole turn of angles, in their unit,
            which go the shorter way round.
    """
    longest = longest_step(times)
    after = np.searchsorted(times, wanted)
    left = times[np.maximum(after - 1, 0)]
    right = times[np.minimum(after, len(times) - 1)]
    is_known = np.where(
        (after == 0) | (after == len(times)),
        np.minimum(np.abs(wanted - left), np.abs(wanted - right)) <= longest,
        (right - left <= longest) | (wanted == right),
    )
    if turn is None:
        found = np.interp(wanted, times, values)
    elif turn == HELD:
        found = values[np.maximum(np.searchsorted(times, wanted, side="right") - 1, 0)]
    else:
        found = _on_circle(wanted, times, values, turn)
    return np.where(is_known, found, np.nan)


def _on_circle(wanted: Floats, times: Floats, values: Floats, turn: float) -> Floats:
    """Angles in proportion, on the shorter way between two neighbours; in the range that the values have."""
    found = np.interp(wanted, times, values)
    if len(times) < 2:  # nothing is in between
        return found
    left = np.clip(np.searchsorted(times, wanted, side="right") - 1, 0, len(times) - 2)
    way = values[left + 1] - values[left]
    share = np.interp(wanted, times, np.arange(len(times))) - left
    goes_round = (np.abs(way) > turn / 2.0) & (share > 0.0) & (share < 1.0)
    lowest = -turn / 2.0 if np.nanmin(values, initial=0.0) < 0.0 else 0.0
    round_it = values[left] + share * (np.remainder(way + turn / 2.0, turn) - turn / 2.0)
    return np.where(goes_round, np.remainder(round_it - lowest, turn) + lowest, found)


def _turn_of(message: str, field: str, column: NDArray[Any]) -> float | None:
    """A field's way from one value to the next, as ``between`` takes it.

    A whole number with a unit is something measured, in steps; without one it is a code, a count or a mask. Of a
    message that no dialect has, such as a campaign's series, all is measured.
    """
    try:
        codes = message_named(message).fieldenums_by_name
    except LocalProtocolError:
        return None
    unit = _field_unit(message, field)
    if field in codes or (column.dtype.kind in "iu" and not unit):
        return HELD
    return TURNS.get(unit)


def pieces(times: Floats) -> list[slice]:
    """The parts of a series between its gaps; ``times`` ascend."""
    edges = [0, *(np.flatnonzero(np.diff(times) > longest_step(times)) + 1).tolist(), len(times)]
    return [slice(begin, end) for begin, end in pairwise(edges)]


def with_gaps(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """The series with a NaN in each gap, which breaks a drawn line; shapes (n,) and (n,) or (n, k)."""
    rows = np.flatnonzero(np.diff(times) > longest_step(times)) + 1
    middle = (times[rows] + times[rows - 1]) / 2.0
    return np.insert(times, rows, middle), np.insert(values.astype(np.float64), rows, np.nan, axis=0)


KEEPS_UNIT = {"abs", "min", "max", "hypot"}  # of values of one unit
THOUSANDTHS = {"mm": "m", "mV": "V", "ms": "s"}  # and the unit of what 1000 of them are
ANGLES = {"deg": ("rad", "deg"), "rad": ("deg", "rad")}  # a function's unit of what it takes, and of what it gives


def unit_of(node: ast.expr) -> str:
    """The unit of an expression's tree, such as ``m/s``."""
    match node:
        case (
            ast.Attribute(value=ast.Name(id=message), attr=field)
            | ast.Subscript(value=ast.Attribute(value=ast.Name(id=message), attr=field))
        ):
            return _field_unit(message, field)
        case ast.UnaryOp(operand=operand):
            return unit_of(operand)
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub(), right=right):
            return _common([left, right])
        case ast.BinOp(left=left, op=ast.Div(), right=ast.Constant(value=1000)):
            return THOUSANDTHS.get(unit_of(left), "")
        case ast.Call(func=ast.Name(id=name), args=arguments) if name in ANGLES:
            taken, given = ANGLES[name]
            unit = _common(arguments)
            return given + unit.removeprefix(taken) if unit.startswith(taken) else ""
        case ast.Call(func=ast.Name(id="atan2")):
            return "rad"
        case ast.Call(func=ast.Name(id=name), args=arguments) if name in KEEPS_UNIT:
            return _common(arguments)
    return ""


def _common(parts: list[ast.expr]) -> str:
    """The unit that all parts have; a bare number has that of the others."""
    units = {unit_of(part) for part in parts if not _is_number(part)}
    return units.pop() if len(units) == 1 else ""


def _is_number(node: ast.expr) -> bool:
    return not any(isinstance(part, ast.Attribute) for part in ast.walk(node))


def _field_unit(message: str, field: str) -> str:
    try:
        units: dict[str, str] = message_named(message).fieldunits_by_name
    except LocalProtocolError:
        return ""
    return units.get(field, "")


MAX_CANDIDATES = 3  # named in place of a message that the log does not have
MAX_LISTED = 8  # messages named where none is near
MAX_LENGTH = 400  # of an expression [characters]
FIELD_CONSTANTS = {"pi": np.pi, "g": 9.80665}
_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.USub: operator.neg, ast.UAdd: operator.pos,
}  # fmt: skip
FIELD_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": np.abs, "sqrt": np.sqrt, "exp": np.exp, "log10": np.log10, "sin": np.sin, "cos": np.cos, "deg": np.degrees,
    "rad": np.radians, "hypot": np.hypot, "atan2": np.arctan2, "min": np.minimum, "max": np.maximum,
}  # fmt: skip

_UP = "cos(ATTITUDE.pitch) * cos(ATTITUDE.roll)"  # level is nose up in the hover
_ASIDE = "hypot(sin(ATTITUDE.pitch), cos(ATTITUDE.pitch) * sin(ATTITUDE.roll))"
PANEL_NAMES: Mapping[str, str] = {  # quantities by the names that the ground station's panels give them
    "V": "DARKO_HYBRID_STATE.v_hover",
    "V_forward": "DARKO_HYBRID_STATE.v_forward",
    "tilt": f"deg(atan2({_ASIDE}, {_UP}))",
    "nose": f"deg(atan2({_UP}, {_ASIDE}))",
    "altitude": "GLOBAL_POSITION_INT.relative_alt / 1000",
    "north": "LOCAL_POSITION_NED.x",
    "east": "LOCAL_POSITION_NED.y",
    "climb": "-LOCAL_POSITION_NED.vz",
    "speed": "hypot(LOCAL_POSITION_NED.vx, LOCAL_POSITION_NED.vy)",
    "airspeed": "VFR_HUD.airspeed",
    "wind": "hypot(DARKO_AIR.wind_estimate[0], DARKO_AIR.wind_estimate[1])",
    "power": "DARKO_ENERGY.power",
    "battery": "SYS_STATUS.battery_remaining",
}


def completions(text: str, sent: Collection[str]) -> list[str]:
    """Texts that an expression may become whose last word is being typed: names, functions, messages, fields.

    Args:
        text: As typed so far.
        sent: Messages that there are.
    """
    word = re.search(r"[A-Za-z_][\w.]*$", text)
    if word is None:
        return []
    before, (message, dot, field) = text[: word.start()], word.group().partition(".")
    if dot:
        try:
            fields = message_named(message.upper()).fieldnames
        except LocalProtocolError:
            return []
        return [f"{before}{message.upper()}.{name}" for name in fields if name.startswith(field)]
    named = [name for name in (*PANEL_NAMES, *(f"{name}(" for name in FIELD_FUNCTIONS)) if name.startswith(message)]
    return [before + name for name in (*named, *(f"{m}." for m in sorted(sent) if m.startswith(message.upper())))]


class FieldTable(Protocol):
    """Messages of one sender, or of all, as arrays."""

    where: str  # they are, in words: "the log"

    @property
    def names(self) -> Collection[str]:
        """Messages that are there."""

    def elsewhere(self, name: str) -> str:
        """Words about a known message that is not there, but others sent; empty without such."""

    def times(self, name: str) -> Floats:
        """Times of the messages of a name [s], shape (n,).

        Raises:
            LocalProtocolError: There is no such message in any dialect.
        """

    def columns(self, name: str) -> Mapping[str, NDArray[Any]]:
        """Their fields, of shape (n,) or (n, count).

        Raises:
            LocalProtocolError: There is no such message in any dialect.
        """


class LoggedFields:
    """A log's messages of one source; times are of its records [s]."""

    where = "the log"

    def __init__(self, reader: TlogReader, source: Source | None, times: Floats) -> None:
        self._reader, self._source, self._times = reader, source, times

    @property
    def names(self) -> Collection[str]:
        """Messages that the source sent."""
        return [name for name in self._reader.names if len(self._reader.rows(name, self._source))]

    def elsewhere(self, name: str) -> str:
        """Words that name the others who sent a message, such as the station; empty if nobody did."""
        rows = self._reader.rows(name)
        senders = np.unique(np.stack((self._reader.systems[rows], self._reader.components[rows]), axis=1), axis=0)
        named = ", ".join(f"{system}/{component}" for system, component in senders.tolist())
        return f"the vehicle sent no {name}, {named} did: the columns are of the vehicle's messages" if named else ""

    def times(self, name: str) -> Floats:
        """Times of the messages of a name [s], shape (n,)."""
        return self._times[self._reader.rows(name, self._source)]

    def columns(self, name: str) -> Mapping[str, NDArray[Any]]:
        """Their fields."""
        return self._reader.columns(name, self._source)


class Curve(NamedTuple):
    """An expression's values."""

    text: str
    message: str  # whose times they have
    times: Floats  # [s], shape (n,)
    values: Floats  # shape (n,); NaN where another message lacked
    unit: str  # empty where it is not known


class Quantity(NamedTuple):
    """An expression's values."""

    name: str
    rows: NDArray[np.int64]  # records that its times are of, shape (n,)
    values: Floats  # shape (n,)
    unit: str  # empty where it is not known
    message: str  # whose times they have


def quantity(
    reader: TlogReader,
    text: str,
    source: Source | None = None,
    times: Floats | None = None,
    message: str | None = None,
) -> Quantity:
    """The values of an expression; NaN where another message than the first one lacked.

    Args:
        reader: The log.
        text: The expression.
        source: Only messages of this (system, component).
        times: Of the log's records [s], by which messages of two kinds meet; None: by the recorder's clock.
        message: Whose times the values have; None: the one that comes first in the text.

    Raises:
        FileError: It is no expression, or names what the log or the dialect does not have; the message says which.
    """
    found = curve(LoggedFields(reader, source, reader.clock.playing if times is None else times), text, message)
    return Quantity(text.strip(), reader.rows(found.message, source), found.values, found.unit, found.message)


def curve(table: FieldTable, text: str, message: str | None = None) -> Curve:
    """The values of an expression at the times of a message.

    Args:
        table: The messages.
        text: The expression.
        message: None: the one that comes first in the text.

    Raises:
        FileError: It is no expression, or names what the table or the dialect does not have; the message says which.
    """
    tree, unit = _parsed(text)
    walker = _Walker(table, text, message)
    with np.errstate(all="ignore"):  # what has no value is NaN, and is not drawn
        values = walker.value(tree)
    if walker.message is None or not walker.has_field:
        raise FileError(f"{text}: names no field of a message")
    times = table.times(walker.message)
    return Curve(text.strip(), walker.message, times, np.broadcast_to(np.asarray(values, float), times.shape), unit)


def expression_unit(text: str) -> str:
    """The unit of an expression, such as ``m/s``; empty if it is not known.

    Raises:
        FileError: It is no expression.
    """
    return _parsed(text)[1]


@lru_cache(maxsize=200)
def _parsed(text: str) -> tuple[ast.expr, str]:
    """An expression's tree, and its unit."""
    if len(text) > MAX_LENGTH:
        raise FileError(f"{text[:40]}...: longer than {MAX_LENGTH} characters")
    try:
        tree = ast.parse(text.strip().replace("^", "**"), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise FileError(f"{text}: is not an expression of fields, such as ATTITUDE.roll * 57.3") from None
    tree = _PanelNames().visit(tree)
    return tree, unit_of(tree)


class _PanelNames(ast.NodeTransformer):
    """Puts what a name of the panels means in its place."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """A message's name is none of these."""
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """A name that stands alone."""
        return ast.parse(PANEL_NAMES[node.id], mode="eval").body if node.id in PANEL_NAMES else node


class _Walker:
    """Evaluates one expression's tree.

    Attributes:
        message: Whose times the values have; None: no field was met.
        has_field: Whether one was met.
    """

    def __init__(self, table: FieldTable, text: str, message: str | None) -> None:
        self._table, self._text = table, text
        self.message, self.has_field = message, False

    def value(self, node: ast.expr) -> Floats | float:
        """Of a node."""
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                return float(number)
            case ast.Name(id=name) if name in FIELD_CONSTANTS:
                return FIELD_CONSTANTS[name]
            case ast.UnaryOp(op=op, operand=operand) if type(op) in _OPERATORS:
                return _float(_OPERATORS[type(op)](self.value(operand)))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                return _float(_OPERATORS[type(op)](np.asarray(self.value(left)), self.value(right)))
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FIELD_FUNCTIONS:
                return self._called(name, arguments)
            case ast.Attribute(value=ast.Name(id=message), attr=field):
                return self._field(message, field, None)
            case ast.Subscript(
                value=ast.Attribute(value=ast.Name(id=message), attr=field), slice=ast.Constant(value=int() as index)
            ):
                return self._field(message, field, index)
            case ast.Name(id=name) if name not in FIELD_FUNCTIONS:
                where = "" if name == self._text.strip() else f"{self._text}: "
                raise FileError(f"{where}{name} is not a field: {self._field_hint(name)}")
        raise FileError(f"{self._text}: {ast.unparse(node)} is not a field, a number or a known function")

    def _called(self, name: str, arguments: list[ast.expr]) -> Floats | float:
        given = [self.value(argument) for argument in arguments]
        wanted = FIELD_FUNCTIONS[name].nin  # type: ignore[attr-defined] # all are numpy's
        if len(given) != wanted:
            raise FileError(f"{self._text}: {name} takes {wanted} value{'s' * (wanted != 1)}, not {len(given)}")
        return _float(FIELD_FUNCTIONS[name](*given))

    def _field(self, message: str, field: str, index: int | None) -> Floats:
        try:
            times = self._table.times(message)
            column = self._table.columns(message).get(field)
        except LocalProtocolError:
            raise FileError(f"{self._text}: the dialect has no message {message}; {self._messages(message)}") from None
        if column is None:
            fields = message_named(message).fieldnames
            raise FileError(f"{self._text}: {message} has no field {field}; it has {', '.join(fields)}")
        if not len(times):
            if words := self._table.elsewhere(message):
                raise FileError(f"{self._text}: {words}")
            raise FileError(f"{self._text}: {self._table.where} has no {message}; {self._messages(message)}")
        values = self._one_column(message, field, column, index)
        return self._at_first_times(message, times, values, _turn_of(message, field, column))

    def _field_hint(self, name: str) -> str:
        """Fields of a message that stands alone, or messages that may be meant."""
        if name in self._table.names:
            return f"of this message they are {', '.join(message_named(name).fieldnames)}"
        begun = [known for known in PANEL_NAMES if name and known.startswith(name.lower())]
        if begun:
            return f"did you mean {' or '.join(begun[:MAX_CANDIDATES])}?"
        if not get_close_matches(name.upper(), self._table.names):
            near = get_close_matches(name, PANEL_NAMES, n=1)
            if near:
                return f"did you mean {near[0]}?"
            return f"write MESSAGE.field, or one of {', '.join(PANEL_NAMES)}; {self._messages(name)}"
        return f"write MESSAGE.field; {self._messages(name)}"

    def _messages(self, wanted: str) -> str:
        """Messages that the vehicle sent and that may be meant; all, if no name is near."""
        sent = self._table.names
        near = get_close_matches(wanted.upper(), sent, n=MAX_CANDIDATES)
        rest = f" and {len(sent) - MAX_LISTED} more" if len(sent) > MAX_LISTED else ""
        return f"did you mean {' or '.join(near)}?" if near else f"it has {', '.join(list(sent)[:MAX_LISTED])}{rest}"

    def _one_column(self, message: str, field: str, column: NDArray[Any], index: int | None) -> Floats:
        if column.dtype.kind not in "iuf":
            raise FileError(f"{self._text}: {message}.{field} is text")
        if column.ndim == 1:
            if index is not None:
                raise FileError(f"{self._text}: {message}.{field} is a single number, without [{index}]")
            return column.astype(float)
        if index is None or not 0 <= index < column.shape[1]:
            raise FileError(f"{self._text}: {message}.{field} has the numbers [0] to [{column.shape[1] - 1}]")
        return np.asarray(column[:, index], float)

    def _at_first_times(self, message: str, times: Floats, values: Floats, turn: float | None) -> Floats:
        """Values at the times of the message that came first."""
        self.has_field = True
        if self.message is None:
            self.message = message
        if self.message == message:
            return values
        order = np.argsort(times, kind="stable")
        return between(self._table.times(self.message), times[order], values[order], turn)


def _float(value: Any) -> Floats | float:  # noqa: ANN401 - of numpy's functions
    return value if isinstance(value, np.ndarray) else float(value)
