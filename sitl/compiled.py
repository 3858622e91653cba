"""Compilation of functions: one text serves a single flight, batches and plain Python, to the bit.

IEEE arithmetic is kept as written: no ``fastmath``, no fused multiply-add, no library function whose last bit depends
on the processor. In compiled code a division by zero gives an infinity, as in the hardware; nothing in the loop raises.
"""

from __future__ import annotations

import gc
import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import Any, ParamSpec, TypeVar

import numba.np.linalg
from numba import njit, typeof
from numba.core.dispatcher import Dispatcher
from numba.extending import register_jitable

from sitl.tools.inner_compiler import InnerCompiler, PartCompiler, WholeCompiler

# What is only called from compiled code needs no door for Python or C: that saves a third of the compiling.
INNER = {
    "error_model": "numpy",
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": InnerCompiler,
}
COUNTED, UNCOUNTED = {"_nrt": True}, {"_nrt": False}  # references to arrays; what makes or returns one needs them
INLINED = {**INNER, "forceinline": True}
LINKED = {"no_cpython_wrapper": True, "pipeline_class": PartCompiler}
TIED = {"pipeline_class": WholeCompiler}

Args = ParamSpec("Args")
Result = TypeVar("Result")


def _read_array_functions() -> None:
    """Read numba's array functions without scipy.linalg, whose import takes a sixth of a vehicle's start.

    Numba asks whether it is there before the first function is compiled or read from disk. It is, and a function that
    needed it would still find it.
    """
    asked = numba.np.linalg.ensure_blas
    numba.np.linalg.ensure_blas = lambda: None
    try:
        import_module("numba.np.arraymath")
    finally:
        numba.np.linalg.ensure_blas = asked


_read_array_functions()


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
    return _kept(function, **COUNTED)


def uncounted_entry(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """An entry that makes no array: the references to those it is given are not counted, which is dear."""
    return _kept(function, **UNCOUNTED)


def part(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """Compile a function that only a whole calls, never Python, on its own: processes share a first start's work.

    Like an uncounted entry it makes no array.
    """
    return _kept(function, **UNCOUNTED, **LINKED)


def counted_part(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """A part that makes arrays."""
    return _kept(function, **COUNTED, **LINKED)


def whole(function: Callable[Args, Result]) -> Callable[Args, Result]:
    """An uncounted entry that calls parts, and leaves them as they are compiled."""
    return _kept(function, **UNCOUNTED, **TIED)


def _kept(function: Callable[Args, Result], **options: Any) -> Callable[Args, Result]:  # noqa: ANN401 - numba's
    compiled: Callable[Args, Result]
    try:
        compiled = bare(cache=True, **options)(function)
    except RuntimeError:  # no folder can be written: neither the cache's, nor the package's, nor the user's
        compiled = bare(**options)(function)
    return compiled


def bare(**options: Any) -> Callable[[Callable[..., Any]], Any]:  # noqa: ANN401 - numba's
    """A decorator that compiles a function that Python may call, with these options of numba besides."""
    make: Any = njit  # its annotations do not know all options
    decorator: Callable[[Callable[..., Any]], Any] = make(
        error_model="numpy", nogil=True, no_cfunc_wrapper=True, **options
    )
    return decorator


def compile_part(function: Callable[..., Any], like: Mapping[str, Any]) -> None:
    """Compile an entry for arguments like these, by its parameters' names, or read it from disk; nothing runs."""
    if isinstance(function, Dispatcher):  # else nothing is compiled at all
        names = inspect.signature(function.py_func).parameters
        function.compile(tuple(typeof(like[name]) for name in names))  # type: ignore[no-untyped-call]


@contextmanager
def compiling() -> Iterator[None]:
    """A context for much compilation, without garbage collection, which would take a tenth longer."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()
