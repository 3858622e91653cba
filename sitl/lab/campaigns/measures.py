"""Measures of a flight: expressions of what was recorded, in the words of logs, made single numbers over time.

``max(abs(DARKO_TRUTH.position[2] + 30), after=20)`` is the greatest distance from a height of 30 m once 20 s are over.
Fields are those of the messages of the same names, by the truth and unrounded.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from protocol.errors import FileError
from protocol.flight_log.field_expressions import FIELD_CONSTANTS, FIELD_FUNCTIONS, curve
from sitl import Actuators, Airframe, Array, Body, Law, Plant, Quaternion, Recording, Regime, Vector
from sitl.lab.campaigns.number_expressions import (
    COMPARED_BY,
    NUMBER_FUNCTIONS,
    TIME_NAME,
    ExpressionError,
    NumberWalker,
    Value,
    is_judgement,
    parsed,
    unknown_name,
)
from sitl.lab.campaigns.ways import WAY_FUNCTIONS, distance_from_way
from sitl.lab.identification import rotations
from sitl.lab.identification.flight_log import FLIP_SIGNS
from sitl.model.ground import CLEAR, LEVEL_GROUND, GroundPlane, feet_aloft, height_over, is_touching

CASE, SERIES = "CASE", "SERIES"  # messages that stand for the case's numbers and for named series
TO_WIRE = np.array([1.0, 1.0, -1.0, -1.0])  # of a quaternion, from FLU and NWU to FRD and NED
RECORDED_FIELDS: dict[str, dict[str, Callable[[Recording], npt.NDArray[Any]]]] = {
    "DARKO_TRUTH": {
        "position": lambda r: r.position * FLIP_SIGNS,
        "velocity": lambda r: r.velocity * FLIP_SIGNS,
        "q": lambda r: rotations.hover_attitudes(r.attitude) * TO_WIRE,
        "rates": lambda r: rotations.to_hover_frame(r.rates) * FLIP_SIGNS,
    },
    "DARKO_ACTUATORS": {"motor_speed": lambda r: r.actuators[:, :2], "elevon": lambda r: r.actuators[:, 2:]},
    "DARKO_HYBRID_STATE": {"law": lambda r: r.law, "v_hover": lambda r: r.v_hover},
    "DARKO_ENERGY": {"energy": lambda r: r.energy},
    "DARKO_AIR": {"wind_estimate": lambda r: r.wind * FLIP_SIGNS},
    "POSITION_TARGET_LOCAL_NED": {
        "x": lambda r: r.reference[:, 0],
        "y": lambda r: -r.reference[:, 1],
        "z": lambda r: -r.reference[:, 2],
    },
}
GROUND, GROUND_FIELDS = "GROUND", ("height", "touching")  # which no message tells
FLIGHT_MESSAGE, FLIGHT_FIELDS = "FLIGHT", ("forward",)  # likewise: whether it flew forward, 0 or 1
FLIGHT_FACTS = (  # numbers that every flight has
    "time", "energy", "jumps", "failsafes", "tilt", "crashed", "diverged", "landed", "forward", "mission", "ground",
    "home", "cut", "impact", "warned", "astray", "seed",
)  # fmt: skip
REDUCTIONS: dict[str, Callable[..., Any]] = {  # of a series to a number
    "min": np.min, "max": np.max, "mean": np.mean, "first": lambda x: x[0], "final": lambda x: x[-1],
    "rms": lambda x: np.sqrt(np.mean(x**2)), "quantile": np.quantile, "share": np.mean, "at": np.mean,  # at one time
    "rms_rate": lambda x: np.sqrt(np.mean(x**2)),  # of the differences, by the time between two
}  # fmt: skip
WITH_NUMBER = {"quantile", "at"}  # which take a number, too
MEASURE_FUNCTIONS = {*NUMBER_FUNCTIONS, *FIELD_FUNCTIONS, *REDUCTIONS, *WAY_FUNCTIONS}
INSTANT = 1e-6  # times that differ by less are the same [s]


class Measure(NamedTuple):
    """One number of every flight."""

    text: str
    unit: str = ""

    @property
    def is_judgement(self) -> bool:
        """Whether it is true or false."""
        return is_judgement(parsed(self.text))


class FlightSetting(NamedTuple):
    """Parts of a flight that no recording has: ground, feet that would touch it, and when it flew forward."""

    ground: GroundPlane
    airframe: Airframe
    forward_at: frozenset[float] = frozenset()  # times of the samples at which it flew forward [s]


def ground_fields(flown: Recording, setting: FlightSetting) -> dict[str, npt.NDArray[Any]]:
    """Height over the ground [m], (n,), and whether it is touched, 0 or 1, (n,)."""
    heights = np.array([height_over(setting.ground, Vector(*p)) for p in flown.position.tolist()])
    touching = np.zeros(len(heights))
    for row in np.flatnonzero(heights < CLEAR):
        parts = (flown.position, flown.velocity, flown.attitude, flown.rates)
        p, v, q, w = (part[row].tolist() for part in parts)
        body = Body(Vector(*p), Vector(*v), Quaternion(*q), Vector(*w))
        touching[row] = is_touching(Plant(body, Actuators(0.0, 0.0, 0.0, 0.0), feet_aloft()), *setting[:2])
    return {"height": heights, "touching": touching}


class RecordedFields:
    """A recorded flight as messages; see :class:`protocol.flight_log.field_expressions.FieldTable`.

    Args:
        flown: The recording.
        numbers: Of the case, and words, by name; more may be added.
        setting: What it does not have.
    """

    where = "a flight of a campaign"

    def __init__(self, flown: Recording, numbers: dict[str, Value], setting: FlightSetting) -> None:
        self._flown, self.numbers, self._setting = flown, numbers, setting
        self.series: dict[str, Array] = {TIME_NAME: flown.time}
        self._made: dict[str, Mapping[str, npt.NDArray[Any]]] = {}

    def elsewhere(self, name: str) -> str:  # noqa: ARG002 - there is one vehicle
        """Nothing."""
        return ""

    @property
    def positions(self) -> Array:
        """Of the samples, world NWU, (n, 3) [m]."""
        return self._flown.position

    @property
    def names(self) -> Collection[str]:
        """Messages that there are."""
        return RECORDED_FIELDS

    def times(self, name: str) -> Array:  # noqa: ARG002 - all are recorded at once
        """Times of the samples [s], (n,)."""
        return self._flown.time

    def columns(self, name: str) -> Mapping[str, npt.NDArray[Any]]:
        """Fields of a message, of shape (n,) or (n, count)."""
        if name == SERIES:
            return self.series
        if name == CASE:
            return {key: np.full(len(self._flown.time), value) for key, value in self.numbers.items()}
        if name == GROUND and name not in self._made:
            self._made[name] = ground_fields(self._flown, self._setting)
        if name == FLIGHT_MESSAGE:
            return {"forward": np.array([float(time in self._setting.forward_at) for time in self._flown.time])}
        if name not in self._made:
            self._made[name] = {key: made(self._flown) for key, made in RECORDED_FIELDS[name].items()}
        return self._made[name]


class _FieldNames(ast.NodeTransformer):
    """Has names of numbers and series become fields."""

    def __init__(self, series: Collection[str]) -> None:
        self._series = series

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id in FIELD_CONSTANTS or node.id in FIELD_FUNCTIONS:
            return node
        message = SERIES if node.id in self._series else CASE
        return ast.Attribute(ast.Name(message, ast.Load()), node.id, ast.Load())

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        return node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        node.args = [self.visit(argument) for argument in node.args]
        return node


class _Ways(ast.NodeTransformer):
    """Has ways become names of series.

    Args:
        made: Gives the name of a way's series.
    """

    def __init__(self, made: Callable[[str, list[ast.expr]], str]) -> None:
        self._made = made

    def visit_Call(self, node: ast.Call) -> ast.expr:
        if isinstance(node.func, ast.Name) and node.func.id in WAY_FUNCTIONS:
            return ast.Name(self._made(node.func.id, node.args), ast.Load())
        node.args = [self.visit(argument) for argument in node.args]
        return node


@lru_cache(maxsize=2000)
def _field_text(text: str, series: tuple[str, ...]) -> str:
    """A series' expression with nothing but fields."""
    return ast.unparse(_FieldNames(series).visit(ast.parse(text, mode="eval").body))


class MeasureWalker(NumberWalker):
    """Works out measures of one flight.

    Args:
        fields: The flight, whose numbers are the names that measures may have.
    """

    def __init__(self, fields: RecordedFields) -> None:
        super().__init__(fields.numbers)
        self._fields = fields

    def series(self, text: str) -> Array:
        """The values of a series' expression, (n,).

        Raises:
            ExpressionError: It names what is not recorded.
        """
        _check_fields(parsed(text))
        plain = ast.unparse(_Ways(self._way).visit(ast.parse(text.strip(), mode="eval").body))
        try:
            return curve(self._fields, _field_text(plain, tuple(self._fields.series))).values
        except FileError as error:
            raise ExpressionError(str(error)) from None

    def _way(self, name: str, arguments: list[ast.expr]) -> str:
        """The name of the series of the distance from a way."""
        size, numbers = WAY_FUNCTIONS[name], [float(self.value(argument)) for argument in arguments]
        if not numbers or len(numbers) % size:
            raise ExpressionError(f"{name} takes {size} numbers for each point")
        points, made = np.reshape(numbers, (-1, size)), f"way{len(self._fields.series)}"
        self._fields.series[made] = distance_from_way(self._fields.positions[:, :size], points.tolist())
        return made

    def _called(self, name: str, arguments: list[ast.expr], keywords: list[ast.keyword]) -> Any:  # noqa: ANN401
        if name in REDUCTIONS and (keywords or self._is_series(arguments[:1])):
            return self._reduced(name, arguments, {keyword.arg or "": keyword.value for keyword in keywords})
        return super()._called(name, arguments, keywords)

    def _reduced(self, name: str, arguments: list[ast.expr], keywords: dict[str, ast.expr]) -> float:
        if len(arguments) != 1 + (name in WITH_NUMBER) or not set(keywords) <= {"after", "where"}:
            takes = "a series and a number" if name in WITH_NUMBER else "a series"
            raise ExpressionError(f"{name} over time takes {takes}, and after= and where=")
        values = self._mask(arguments[0]) if name == "share" else self._values(arguments[0])
        times = self._fields.times("")
        kept = np.ones(len(times), bool)
        if "after" in keywords:
            kept &= times > float(self.value(keywords["after"])) + INSTANT
        if "where" in keywords:
            kept &= self._mask(keywords["where"])
        if not kept.any():
            return float("nan")
        values, times = np.broadcast_to(values, kept.shape)[kept], times[kept]
        if name == "rms_rate":
            values = np.diff(values) / np.diff(times)
        if name == "at":
            row = int(np.searchsorted(times, float(self.value(arguments[1])) + INSTANT)) - 1
            return float(values[max(row, 0)])
        return float(REDUCTIONS[name](values, *(float(self.value(argument)) for argument in arguments[1:])))

    def _is_series(self, nodes: list[ast.expr]) -> bool:
        inner = [part for node in nodes for part in ast.walk(node)]
        known = {*self._fields.series, *WAY_FUNCTIONS}
        return any(
            isinstance(part, ast.Attribute) or (isinstance(part, ast.Name) and part.id in known) for part in inner
        ) and not any(_reduces(part) for part in inner)

    def _values(self, node: ast.expr) -> Any:  # noqa: ANN401 - an array, or a number
        return self.series(ast.unparse(node)) if self._is_series([node]) else self.value(node)

    def _mask(self, node: ast.expr) -> npt.NDArray[np.bool_]:
        """Samples of which a condition holds, (n,)."""
        match node:
            case ast.BoolOp(op=op, values=parts):
                joined = np.logical_and if isinstance(op, ast.And) else np.logical_or
                return np.asarray(joined.reduce([self._mask(part) for part in parts]))
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return ~self._mask(operand)
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in COMPARED_BY:
                holds = COMPARED_BY[type(op)](self._values(left), self._values(right))
                return np.broadcast_to(np.asarray(holds, bool), self._fields.times("").shape)
        raise ExpressionError(f"{ast.unparse(node)} is not a condition of series, such as DARKO_AIR.x > 1")


class LookWalker(NumberWalker):
    """Works out conditions of a vehicle as it is now, in the words of measures.

    Args:
        sample: The vehicle, one row.
        series: Named expressions of it.
        names: Numbers and words that conditions may have.
    """

    def __init__(self, sample: Recording, series: Mapping[str, str], names: Mapping[str, Value]) -> None:
        super().__init__(names)
        self._sample, self._series = sample, series

    def value(self, node: ast.expr) -> Any:  # noqa: ANN401 - a row for each kind of node
        """Of a node."""
        match node:
            case ast.Name(id=name) if name in self._series:
                return self.value(parsed(self._series[name]))
            case ast.Attribute():
                _check_fields(node)
                return self._field(node)[0]
            case ast.Subscript(value=ast.Attribute() as field, slice=ast.Constant(value=int() as index)):
                _check_fields(field)
                return self._field(field)[0][index]
        return super().value(node)

    def _field(self, node: ast.Attribute) -> npt.NDArray[Any]:
        message = node.value.id  # type: ignore[attr-defined] # it is checked
        if message not in RECORDED_FIELDS:
            raise ExpressionError(f"{message} is of measures alone")
        return RECORDED_FIELDS[message][node.attr](self._sample)


def _reduces(node: ast.AST) -> bool:
    """Whether a call makes a number of a series whatever it is given."""
    two_sided = {"min", "max"}
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and (
            node.func.id in REDUCTIONS.keys() - two_sided
            or (node.func.id in two_sided and (len(node.args) == 1 or bool(node.keywords)))
        )
    )


def _check_fields(tree: ast.expr) -> None:
    """Refuse fields that no flight of a campaign records."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            others = {GROUND: GROUND_FIELDS, FLIGHT_MESSAGE: FLIGHT_FIELDS}
            known: dict[str, Collection[str]] = {**RECORDED_FIELDS, **others}
            message = known.get(node.value.id)
            if message is None:
                raise unknown_name(node.value.id, known)
            if node.attr not in message:
                raise ExpressionError(f"{node.value.id}.{node.attr} is not recorded, but {', '.join(message)}")


def measured(
    measures: Mapping[str, Measure],
    series: Mapping[str, str],
    numbers: Mapping[str, Value],
    flown: Recording,
    setting: FlightSetting,
) -> list[float]:
    """The measures of a flight, each in terms of those before it.

    Args:
        measures: By name.
        series: Named expressions over time, each in terms of those before it.
        numbers: Of the flight and its case, by name.
        flown: The recording.
        setting: What it does not have.

    Raises:
        ExpressionError: A measure has no meaning; the message names it.
    """
    known = dict(numbers)
    fields = RecordedFields(flown, known, setting)
    walker, found, name = MeasureWalker(fields), [], ""
    try:
        for name, text in series.items():
            fields.series[name] = walker.series(text)
        for name, measure in measures.items():
            found.append(walker.number(measure.text))
            known[name] = found[-1]
    except ExpressionError as error:
        raise ExpressionError(f"{name}: {error}") from None
    return found


def check_measures(
    measures: Mapping[str, Measure], series: Mapping[str, str], drawn: Collection[str], airframe: Airframe
) -> None:
    """Try measures on a flight of two samples.

    Raises:
        ExpressionError: One has no meaning; the message names it.
    """
    measured(
        measures,
        series,
        dict.fromkeys((*drawn, *FLIGHT_FACTS), 1.0),
        tried_recording(),
        FlightSetting(LEVEL_GROUND, airframe),
    )


def tried_recording() -> Recording:
    """A flight of two samples, to try expressions on."""
    two, none = np.array([0.0, 0.02]), np.zeros((2, 3))
    return Recording(
        two, none, none, np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)), none, np.zeros((2, 4)),
        np.full(2, int(Law.HOVER_LINEAR)), two, two, none, np.zeros((2, 5)), none, (),
    )  # fmt: skip


def check_conditions(conditions: Collection[str], series: Mapping[str, str], drawn: Collection[str]) -> None:
    """Try conditions of a flight on one sample.

    Raises:
        ExpressionError: One has no meaning; the message shows it.
    """
    words: dict[str, Value] = {"regime": Regime.UPRIGHT.name}
    walker = LookWalker(tried_recording(), series, dict.fromkeys((*drawn, "time", "seed"), 1.0) | words)
    for condition in conditions:
        walker.number(condition)
