"""Numbers of a campaign's file that are worked out of others: ``"deg(wind_from)"``, ``"lowest >= 5 and not crashed"``.

The words are those of a log's expressions (:mod:`protocol.flight_log.field_expressions`), of single numbers, with
comparisons, ``and``, ``or``, ``not`` and ``pick``.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Collection, Mapping
from difflib import get_close_matches
from functools import lru_cache
from typing import Any

from protocol.flight_log.field_expressions import FIELD_CONSTANTS
from sitl import SitlError

Value = float | str  # of what is drawn: a number, or a word
TIME_NAME = "t"  # the time in expressions of series, conditions and parameters [s]
MOST_CHARACTERS = 400  # of an expression


class ExpressionError(SitlError):
    """An expression that has no meaning; the message shows it."""


def _pick(number: float, *values: float) -> float:
    """The value of a number from 0 on; the last one from there on."""
    if not values or number < 0.0:
        raise ValueError("pick takes a number from 0 on, and the values to pick from")
    return values[min(int(number), len(values) - 1)]


NUMBER_FUNCTIONS: dict[str, Callable[..., float]] = {
    "abs": abs, "sqrt": math.sqrt, "exp": math.exp, "log10": math.log10, "sin": math.sin, "cos": math.cos,
    "deg": math.degrees, "rad": math.radians, "hypot": math.hypot, "atan2": math.atan2, "min": min, "max": max,
    "remainder": math.remainder, "pick": _pick,
}  # fmt: skip
ARITHMETIC: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.Mod: operator.mod, ast.USub: operator.neg, ast.UAdd: operator.pos,
}  # fmt: skip
COMPARED_BY: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}  # fmt: skip


@lru_cache(maxsize=2000)
def parsed(text: str) -> ast.expr:
    """An expression's tree.

    Raises:
        ExpressionError: It is no expression.
    """
    if len(text) > MOST_CHARACTERS:
        raise ExpressionError(f"{text[:40]}... is longer than {MOST_CHARACTERS} characters")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ExpressionError(f"{text!r} is not an expression") from None


def has_name(given: Value, name: str) -> bool:
    """Whether an expression has a name in it; a number has none."""
    return isinstance(given, str) and any(
        isinstance(node, ast.Name) and node.id == name for node in ast.walk(parsed(given))
    )


def is_judgement(tree: ast.expr) -> bool:
    """Whether an expression is true or false, so that its share is counted."""
    match tree:
        case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()):
            return True
    return False


class NumberWalker:
    """Works out expressions of single numbers, and of words that are compared.

    Args:
        names: Values of the names that they may have.
    """

    def __init__(self, names: Mapping[str, Value]) -> None:
        self._names = names

    def number(self, text: str) -> float:
        """The value of an expression.

        Raises:
            ExpressionError: It has a name or a call that is not known, or no value.
        """
        try:
            value = self.value(parsed(text))
        except (TypeError, ValueError, OverflowError) as error:
            raise ExpressionError(f"{text!r} has no value: {error}") from None
        if isinstance(value, str | complex):
            raise ExpressionError(f"{text!r} is not a number")
        return float(value)

    def value(self, node: ast.expr) -> Any:  # noqa: ANN401 - a row for each kind of node
        """Of a node."""
        match node:
            case ast.Constant(value=int() | float() as number):
                return number
            case ast.Name(id=name):
                return self._named(name)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return not self.value(operand)
            case ast.UnaryOp(op=op, operand=operand) if type(op) in ARITHMETIC:
                return ARITHMETIC[type(op)](self.value(operand))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in ARITHMETIC:
                return self._divided(op, self.value(left), self.value(right))
            case ast.BoolOp(op=op, values=parts):
                return (all if isinstance(op, ast.And) else any)(bool(self.value(part)) for part in parts)
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in COMPARED_BY:
                return COMPARED_BY[type(op)](self._side(left), self._side(right))
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=keywords):
                return self._called(name, arguments, keywords)
        raise ExpressionError(f"{ast.unparse(node)} is not a number, a name or a known function")

    def _side(self, node: ast.expr) -> Any:  # noqa: ANN401 - a number or a word
        """One side of a comparison, which alone may be a word: ``goal == 'land'``."""
        return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else self.value(node)

    def _called(self, name: str, arguments: list[ast.expr], keywords: list[ast.keyword]) -> Any:  # noqa: ANN401
        if name not in NUMBER_FUNCTIONS or keywords:
            raise ExpressionError(f"there is no function {name} of numbers; there are {', '.join(NUMBER_FUNCTIONS)}")
        return NUMBER_FUNCTIONS[name](*(self.value(argument) for argument in arguments))

    @staticmethod
    def _divided(op: ast.operator, left: Any, right: Any) -> Any:  # noqa: ANN401 - numbers
        """The result of an operation; as arrays have it where a division by zero has none."""
        try:
            return ARITHMETIC[type(op)](left, right)
        except ZeroDivisionError:
            return math.nan if not left or math.isnan(left) else math.copysign(math.inf, left)

    def _named(self, name: str) -> Value:
        if name in self._names:
            return self._names[name]
        if name in FIELD_CONSTANTS:
            return FIELD_CONSTANTS[name]
        raise unknown_name(name, self._names)


def unknown_name(name: str, known: Collection[str]) -> ExpressionError:
    """The error of a name that nothing has."""
    near = get_close_matches(name, known, n=1)
    hint = f"; did you mean {near[0]}?" if near else f"; there are {', '.join(sorted(known)) or 'none'}"
    return ExpressionError(f"there is no {name}{hint}")
