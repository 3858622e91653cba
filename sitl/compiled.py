"""How functions are compiled: one text serves a single flight, batches and plain Python, to the bit.

IEEE arithmetic is kept as written: no ``fastmath``, no fused multiply-add, no library function whose last bit depends
on the processor. In compiled code a division by zero gives an infinity, as in the hardware; nothing in the loop raises.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from numba import njit
from numba.extending import register_jitable

# What is only called from compiled code needs no door for Python or C: that saves a third of the compiling.
INNER = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
INLINED = {**INNER, "forceinline": True}

Args = ParamSpec("Args")
Result = TypeVar("Result")


def kernel(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """Equations on scalars and named tuples: plain Python where Python calls them, inlined where compiled code does."""
    return register_jitable(**INLINED)(function)


def subroutine(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """Likewise, for what is long or seldom needed: compiled once per caller instead of at each call in it."""
    return register_jitable(**INNER)(function)


def entry(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """What Python calls compiled: kept on disk after the first time; other threads may run beside it."""
    return njit(error_model="numpy", cache=True, nogil=True)(function)
