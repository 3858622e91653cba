"""How functions are compiled: one text serves a single flight, batches and plain Python, to the bit.

IEEE arithmetic is kept as written: no ``fastmath``, no fused multiply-add, no library function whose last bit depends
on the processor. Divisions by zero give infinities, as in the hardware; nothing in the loop raises.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from numba import njit

Args = ParamSpec("Args")
Result = TypeVar("Result")


def kernel(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """Equations on scalars and named tuples, made part of every caller."""
    return njit(error_model="numpy", forceinline=True)(function)  # type: ignore[no-any-return]


def entry(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """A function that Python calls: compiled once, then kept on disk; other threads may run beside it."""
    return njit(error_model="numpy", cache=True, nogil=True)(function)  # type: ignore[no-any-return]


def subroutine(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """Equations that are long or seldom needed: compiled once per caller instead of at each call in it."""
    return njit(error_model="numpy")(function)  # type: ignore[no-any-return]
