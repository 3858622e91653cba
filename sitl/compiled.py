"""Compilation of functions: one text serves compiled flights and plain Python, to the bit.

IEEE arithmetic is kept as written: no ``fastmath``, no fused multiply-add, no library function whose last bit depends
on the processor. In compiled code a division by zero gives an infinity, as in the hardware; nothing in the loop raises.
"""

from __future__ import annotations

import gc
import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

import numba
from numba import njit, typeof
from numba.extending import is_jitted, register_jitable

# Called from compiled code alone, so that no door for Python or C is needed: that saves a third of the compiling.
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
    """Compile a function that Python calls. It is kept on disk after the first time, if there is a folder for it.

    Other threads may run beside it.
    """
    return _kept(function)


def part(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """Compile a function that only an entry calls, never Python, on its own: processes share a first start's work."""
    return _kept(function, no_cpython_wrapper=True)


def unkept_entry(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """An entry that is compiled anew in every process, for what is made at run time."""
    return _compiled(function)


def _kept(function: Callable[Args, Result], **options: bool) -> Callable[Args, Result]:
    try:
        return _compiled(function, cache=True, **options)
    except RuntimeError:  # no folder can be written: neither the cache's, nor the package's, nor the user's
        return _compiled(function, **options)


def _compiled(function: Callable[Args, Result], **options: bool) -> Callable[Args, Result]:
    make: Any = njit  # its annotations do not know all options
    compiled: Callable[Args, Result] = make(error_model="numpy", nogil=True, no_cfunc_wrapper=True, **options)(function)
    return compiled


def compile_part(function: Any, like: Mapping[str, Any]) -> None:  # noqa: ANN401 - numba's own type
    """Compile a part for arguments like these, by its parameters' names, or read it from disk; nothing runs."""
    if is_jitted(function):  # else nothing is compiled at all
        names = inspect.signature(function.py_func).parameters
        function.compile(tuple(typeof(like[name]) for name in names))  # type: ignore[no-untyped-call]


def is_compiled(function: Any) -> bool:  # noqa: ANN401 - numba's own type
    """Whether there is nothing to compile before a call."""
    return not is_jitted(function) or bool(function.overloads)


@contextmanager
def compiling(level: int = 2) -> Iterator[None]:
    """A context for much compilation: with less optimisation, and no garbage collection, which would take a tenth.

    The settings are the process's: one thread at a time.

    Args:
        level: Of the compiler, which else works at the third. That takes a fifth longer, and a loop that links parts
            is slower, as they are optimised once more where they are linked.
    """
    config: Any = numba.config  # its annotations lack the settings
    collects, usual = gc.isenabled(), config.OPT
    gc.disable()
    config.OPT = type(usual)(min(usual, level))
    try:
        yield
    finally:
        config.OPT = usual
        if collects:
            gc.enable()
