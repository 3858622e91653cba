"""The plant's own functions evaluated with CasADi's symbols: one text flies and is optimised.

A function of :mod:`sitl.model` is taken with all that it calls, and runs in plain Python on :class:`Symbol` in place of
numbers. Roots, sizes and the larger of two, whose slopes jump or are infinite, are rounded off there, by at most
``ROUNDED_WITHIN``. Any other decision by a symbol is taken both ways, and the answer is chosen from both.
"""

from __future__ import annotations

import atexit
import builtins
import math
import shutil
import tempfile
from collections.abc import Callable
from functools import cache
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any, TypeAlias

import casadi as ca

from sitl import Actuators, Airframe, Body, Quaternion, Vector
from sitl.model.battery import drawn_power
from sitl.model.plant import derivative, inflow

Expression: TypeAlias = Any  # of CasADi, which carries no types
Number: TypeAlias = Any  # a symbol, or a float where all are known
ROUNDED_WITHIN = 0.01  # of kinks, in the unit of what is decided by
ROOT_FLOOR = 1e-8  # added under a root
MODEL = "sitl.model."

_decisions: list[_Decisions] = []  # of the functions that are being evaluated


class Symbol:
    """A scalar expression that calculates as a float does."""

    def __init__(self, expression: Expression) -> None:
        self.expression = expression

    def __add__(self, other: Symbol | float) -> Symbol:
        return Symbol(self.expression + expression_of(other))

    def __sub__(self, other: Symbol | float) -> Symbol:
        return Symbol(self.expression - expression_of(other))

    def __mul__(self, other: Symbol | float) -> Symbol:
        return Symbol(self.expression * expression_of(other))

    def __truediv__(self, other: Symbol | float) -> Symbol:
        return Symbol(self.expression / expression_of(other))

    def __radd__(self, other: float) -> Symbol:
        return Symbol(other + self.expression)

    def __rsub__(self, other: float) -> Symbol:
        return Symbol(other - self.expression)

    def __rmul__(self, other: float) -> Symbol:
        return Symbol(other * self.expression)

    def __rtruediv__(self, other: float) -> Symbol:
        return Symbol(other / self.expression)

    def __neg__(self) -> Symbol:
        return Symbol(-self.expression)

    def __abs__(self) -> Symbol:
        return Symbol(ca.sqrt(self.expression * self.expression + ROUNDED_WITHIN * ROUNDED_WITHIN))

    def __lt__(self, other: Symbol | float) -> SymbolicTruth:
        return SymbolicTruth(self.expression < expression_of(other))

    def __le__(self, other: Symbol | float) -> SymbolicTruth:
        return SymbolicTruth(self.expression <= expression_of(other))

    def __gt__(self, other: Symbol | float) -> SymbolicTruth:
        return SymbolicTruth(self.expression > expression_of(other))

    def __ge__(self, other: Symbol | float) -> SymbolicTruth:
        return SymbolicTruth(self.expression >= expression_of(other))


def expression_of(value: Symbol | float) -> Expression:
    """CasADi's expression of a symbol or a number."""
    return value.expression if isinstance(value, Symbol) else value


class SymbolicTruth:
    """A comparison of symbols; as a truth it is what the way that is being gone says."""

    def __init__(self, expression: Expression) -> None:
        self.expression = expression

    def __bool__(self) -> bool:
        return _decisions[-1].take(self.expression)


class _Undecided(Exception):  # noqa: N818 - no error: a fork in the way
    """A condition that no decision was taken on yet."""

    def __init__(self, condition: Expression) -> None:
        super().__init__()
        self.condition = condition


class _Decisions:
    """Those to be taken one after the other on the way through a function."""

    def __init__(self, ahead: tuple[bool, ...]) -> None:
        self._ahead = list(ahead)

    def take(self, condition: Expression) -> bool:
        if not self._ahead:
            raise _Undecided(condition)
        return self._ahead.pop(0)


def _on_all_ways(run: Callable[[], Any], taken: tuple[bool, ...] = ()) -> Any:  # noqa: ANN401 - what the function gives
    _decisions.append(_Decisions(taken))
    try:
        return run()
    except _Undecided as fork:
        condition = fork.condition
    finally:
        _decisions.pop()
    return _either(condition, _on_all_ways(run, (*taken, True)), _on_all_ways(run, (*taken, False)))


def _either(condition: Expression, yes: Any, no: Any) -> Any:  # noqa: ANN401 - numbers, or tuples of them
    if isinstance(yes, tuple):
        parts = [_either(condition, a, b) for a, b in zip(yes, no, strict=True)]
        return type(yes)(*parts) if hasattr(yes, "_fields") else tuple(parts)
    return Symbol(ca.if_else(condition, expression_of(yes), expression_of(no)))


def _root(x: Number) -> Number:
    return Symbol(ca.sqrt(x.expression + ROOT_FLOOR)) if isinstance(x, Symbol) else math.sqrt(x)


def _larger(first: Number, *others: Number) -> Number:
    for other in others:
        apart = first - other
        first = max(first, other) if isinstance(apart, float) else 0.5 * (first + other + abs(apart))
    return first


def _smaller(*values: Number) -> Number:
    return -_larger(*(-value for value in values))


_REPLACED: dict[str, Any] = {"math": SimpleNamespace(sqrt=_root, pi=math.pi), "max": _larger, "min": _smaller}
_clones: dict[Any, Callable[..., Any]] = {}


def symbolic(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same function for symbols.

    Args:
        function: A kernel of :mod:`sitl.model`.
    """
    if function not in _clones:
        assert isinstance(function, FunctionType)  # noqa: S101 - kernels are, whatever compiles them
        names = {
            name: function.__globals__[name] for name in function.__code__.co_names if name in function.__globals__
        }
        clone = FunctionType(function.__code__, {"__builtins__": builtins}, function.__name__, function.__defaults__)
        _clones[function] = lambda *args: _on_all_ways(lambda: clone(*args))
        clone.__globals__.update({name: _taken_over(value) for name, value in names.items()} | _REPLACED)
    return _clones[function]


def _taken_over(value: Any) -> Any:  # noqa: ANN401 - whatever a module names
    if isinstance(value, FunctionType) and value.__module__.startswith(MODEL):
        return symbolic(value)
    if isinstance(value, ModuleType) and value.__name__.startswith(MODEL):
        kernels = {name: _taken_over(kept) for name, kept in vars(value).items() if isinstance(kept, FunctionType)}
        return SimpleNamespace(**kernels)
    return value


def plant_rates(states: Expression, wind: Vector, a: Airframe) -> tuple[Expression, Expression]:
    """Rates of change of the body in the air, (13,), and the power that the energy account counts [W].

    Args:
        states: Position, velocity, attitude, body rates and actuators, (17,), as of the plant.
        wind: Velocity of the air, world NWU [m/s].
        a: The airframe.
    """
    x = [Symbol(states[i]) for i in range(17)]
    body = Body(Vector(*x[0:3]), Vector(*x[3:6]), Quaternion(*x[6:10]), Vector(*x[10:13]))  # type: ignore[arg-type]
    actuators = Actuators(*x[13:17])  # type: ignore[arg-type]
    free = Vector(0.0, 0.0, 0.0)
    rates = symbolic(derivative)(body, actuators, wind, free, free, a)
    power = symbolic(drawn_power)(actuators, symbolic(inflow)(body, wind), a)
    return ca.vertcat(*(expression_of(part) for group in rates for part in group)), expression_of(power)


@cache
def compiler_options() -> dict[str, Any]:
    """Options of a function that is compiled with its derivatives, ten times quicker; none without a C compiler."""
    compiler = next(filter(shutil.which, ("gcc", "clang")), None)
    if compiler is None:
        return {}
    folder = tempfile.mkdtemp(prefix="darko-optimal-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    how = {"compiler": compiler, "flags": ["-O1"], "directory": f"{folder}/", "cleanup": False}
    return {"jit": True, "compiler": "shell", "jit_temp_suffix": False, "jit_cleanup": False, "jit_options": how}
