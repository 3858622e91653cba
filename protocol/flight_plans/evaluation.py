"""Evaluates expressions against a table of names, with C's rules of whole and real numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final, Protocol, TypeAlias

from protocol.flight_plans.expressions import (
    MAX_WHOLE_NUMBER,
    ArrayItem,
    BlockTitle,
    Call,
    LoopVariable,
    Member,
    Negation,
    Number,
    Operation,
    Reference,
    Tree,
    VariableName,
    expression_text,
)
from protocol.flight_plans.xml_elements import FlightPlanError

Scalar: TypeAlias = int | float
Argument: TypeAlias = Scalar | str  # a text is the name of a block, or of a variable to change


class UnknownNameError(Exception):
    """A table does not hold a name; the text says what is missing."""


class NameTable(Protocol):
    """Values of names in expressions."""

    def value(self, name: str) -> Scalar:
        """The value of a variable or constant.

        Raises:
            UnknownNameError: There is no such variable.
        """

    def item(self, name: str, index: Scalar, member: str) -> Scalar:
        """An item of an array, or a field of it.

        Raises:
            UnknownNameError: There is no such array, item or field.
        """

    def loop_value(self, name: str) -> Scalar:
        """The counter of a loop.

        Raises:
            UnknownNameError: No loop around has this counter.
        """

    def call(self, name: str, arguments: Sequence[Argument]) -> Scalar | Mapping[str, float]:
        """Result of a function call.

        Raises:
            UnknownNameError: There is no such function, or not with so many arguments.
        """


def evaluate(tree: Tree, names: NameTable) -> Scalar:
    """The value of an expression.

    Raises:
        FlightPlanError: A name is unknown, or a number has no value: division by zero, overflow.
    """
    try:
        value = _value(tree, names)
    except UnknownNameError as error:
        raise FlightPlanError(tree.place, str(error)) from None
    except ZeroDivisionError:
        raise FlightPlanError(tree.place, "division by zero") from None
    except (OverflowError, ValueError):
        raise FlightPlanError(tree.place, "the result is not a number") from None
    if not math.isfinite(value) if isinstance(value, float) else abs(value) > MAX_WHOLE_NUMBER:
        raise FlightPlanError(tree.place, "the result is not a number")
    return value


def truth(tree: Tree, names: NameTable) -> bool:
    """Whether a condition holds; errors as of ``evaluate``."""
    return evaluate(tree, names) != 0


def _value(tree: Tree, names: NameTable) -> Scalar:
    match tree:
        case Number():
            return tree.value
        case VariableName():
            return names.value(tree.name)
        case LoopVariable():
            return names.loop_value(tree.name)
        case Negation():
            operand = evaluate(tree.operand, names)
            return -operand if tree.operator == "-" else int(operand == 0)
        case Operation():
            return _operation(tree, names)
        case Call():
            return _result(tree, names)
        case Member():
            return _field(tree, names)
        case ArrayItem():
            return names.item(tree.name, evaluate(tree.index, names), tree.member)
        case BlockTitle() | Reference():
            raise FlightPlanError(tree.place, f"{expression_text(tree)} is not a number")


def _result(tree: Call, names: NameTable) -> Scalar:
    result = _called(tree, names)
    if isinstance(result, Mapping):
        raise FlightPlanError(tree.place, f"{tree.name}() has fields: name one of {', '.join(result)}")
    return result


def _field(tree: Member, names: NameTable) -> Scalar:
    fields = _called(tree.call, names)
    if not isinstance(fields, Mapping) or tree.name not in fields:
        raise FlightPlanError(tree.place, f"{tree.call.name}() has no field {tree.name}")
    return fields[tree.name]


def _called(tree: Call, names: NameTable) -> Scalar | Mapping[str, float]:
    try:
        return names.call(tree.name, [_argument(part, names) for part in tree.arguments])
    except UnknownNameError as error:
        raise FlightPlanError(tree.place, str(error)) from None


def _argument(part: Tree, names: NameTable) -> Argument:
    match part:
        case BlockTitle():
            return part.text
        case Reference():
            return part.name
        case _:
            return evaluate(part, names)


def _operation(tree: Operation, names: NameTable) -> Scalar:
    left = evaluate(tree.left, names)
    if tree.operator == "&&":
        return int(left != 0 and evaluate(tree.right, names) != 0)
    if tree.operator == "||":
        return int(left != 0 or evaluate(tree.right, names) != 0)
    return _OPERATORS[tree.operator](left, evaluate(tree.right, names))


def _quotient(a: Scalar, b: Scalar) -> Scalar:
    """Whole numbers are divided towards zero."""
    if isinstance(a, int) and isinstance(b, int):
        size = abs(a) // abs(b)
        return size if (a < 0) == (b < 0) else -size
    return a / b


def _remainder(a: Scalar, b: Scalar) -> Scalar:
    """Has the sign of the first operand."""
    if isinstance(a, int) and isinstance(b, int):
        return a - b * int(_quotient(a, b))
    return math.fmod(a, b) if b != 0.0 else a / b


def _power(a: Scalar, b: Scalar) -> Scalar:
    value = math.pow(a, b)
    whole = isinstance(a, int) and isinstance(b, int) and b >= 0 and abs(value) < 2**53
    return int(value) if whole else value


_OPERATORS: Final[Mapping[str, Callable[[Scalar, Scalar], Scalar]]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": _quotient,
    "%": _remainder,
    "**": _power,
    "==": lambda a, b: int(a == b),
    "!=": lambda a, b: int(a != b),
    ">": lambda a, b: int(a > b),
    "<": lambda a, b: int(a < b),
    ">=": lambda a, b: int(a >= b),
    "<=": lambda a, b: int(a <= b),
    "|": lambda a, b: int(a) | int(b),
    "&": lambda a, b: int(a) & int(b),
}
