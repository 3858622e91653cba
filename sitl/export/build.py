"""Exported files compiled: with warnings as errors and no fused operations, as a shared library that Python calls."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Iterable
from pathlib import Path
from shutil import which

import numpy as np

from sitl.export.c_types import ExportError
from sitl.export.flat import FLAGS
from sitl.model.airframe import Array

# No product is fused with the sum behind it: processors with such an operation would round once where ours rounds
# twice, and the flight would be another one.
STRICT = ("-std=c99", "-ffp-contract=off")
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Wdouble-promotion", "-Werror")
CONTROLLER_SOURCE, FLAT_SOURCE = "darko_controller.c", "darko_flat.c"
ESTIMATOR_SOURCES = ("darko_estimator.c", "darko_estimator_flat.c")  # where it was asked for
LIBRARY = "darko_controller.so"


def compiler() -> str:
    """The C compiler that is there.

    Raises:
        ExportError: If there is none.
    """
    for name in ("cc", "gcc", "clang"):
        if which(name):
            return name
    raise ExportError("no C compiler: none of cc, gcc and clang is installed")


def run_compiler(command: Iterable[str]) -> None:
    """Run a compiler.

    Raises:
        ExportError: If it refuses; with the first line that tells why.
    """
    words = list(command)
    ran = subprocess.run(words, capture_output=True, text=True, check=False)  # noqa: S603 - chosen by the caller
    if ran.returncode:
        lines = ran.stderr.splitlines() or [f"exit code {ran.returncode}"]
        why = next((line for line in lines if "error" in line), lines[0])
        raise ExportError(f"{words[0]} refuses: {why}")


def shared_library(folder: Path, *, cc: str = "", options: tuple[str, ...] = ("-O2",)) -> Path:
    """Compile the files of a folder; gives the library's path.

    Args:
        folder: Of the exported files.
        cc: The compiler; the one that is there by default.
        options: For it, besides.

    Raises:
        ExportError: If it cannot be compiled, or there is nothing to compile.
    """
    if not (folder / FLAT_SOURCE).is_file():
        raise ExportError(f"{folder} holds no exported controller: darko-sitl export c {folder}")
    made = folder / LIBRARY
    names = [CONTROLLER_SOURCE, FLAT_SOURCE, *(name for name in ESTIMATOR_SOURCES if (folder / name).is_file())]
    sources = [str(folder / name) for name in names]
    run_compiler([cc or compiler(), *STRICT, *WARNINGS, *options, "-fPIC", "-shared", "-o", str(made), *sources, "-lm"])
    return made


class FlatController:
    """The exported controller in a shared library, by flat arrays."""

    def __init__(self, library: Path) -> None:
        """Load it.

        Raises:
            ExportError: If it is that of another version.
        """
        self.functions, self._folder = ctypes.CDLL(str(library.resolve())), library.parent
        address, number = ctypes.c_void_p, ctypes.c_int32
        arguments = {
            "flat_tick": [number, address, address, address],
            "flat_seek": [number, address, address, address],
            "flat_jump": [number, number, address, address, address],
            "flat_values": [address, address, address, address],
            "flat_design": [address],
            "flat_init": [ctypes.c_double, address],
            "flat_enter": [address, number, address, address],
            "flat_begin": [address, address, address],
            "flat_replay": [address, address, address, address, number, address],
        }
        for name, kinds in arguments.items():
            function = getattr(self.functions, name, None)
            if function is None:
                raise ExportError(f"{self._folder} was exported by another version of darko: it has no {name}")
            function.argtypes, function.restype = kinds, None
        for name in ("flat_seek", "flat_enter", "flat_replay", "flat_size", "flat_is_single"):
            getattr(self.functions, name).restype = number
        self._memory = ctypes.create_string_buffer(self.functions.flat_size() + 64)

    @property
    def is_single(self) -> bool:
        """Whether it computes in floats."""
        return bool(self.functions.flat_is_single())

    def sizes(self) -> list[int]:
        """Numbers in a controller, an estimate, a reference and a design."""
        made = (ctypes.c_int32 * 4)()
        self.functions.flat_sizes(made)
        return list(made)

    def design(self) -> Array:
        """The exported design, flat.

        Raises:
            ExportError: If it does not tell its size, as that of an older version.
        """
        size = self.sizes()[3]
        if not size:
            raise ExportError(f"{self._folder} was exported by another version of darko: it does not tell its gains")
        made = np.zeros(size)
        self.functions.flat_design(made.ctypes.data)
        return made

    def replay(self, design: Array, begin: Array, rows: Array) -> tuple[Array, int]:
        """Fly what was recorded once more.

        Args:
            design: Flat.
            begin: The controller at the beginning, flat, (c,).
            rows: Flags, estimate, reference and readings, (n + 1, r).

        Returns:
            The controller after each observation, (n + 1, c), and in how many periods whole steps did anything else
            than halves of them.
        """
        seen = np.zeros((len(rows), len(begin)))
        arrays = [np.ascontiguousarray(array) for array in (design, begin, rows)]
        addresses = [array.ctypes.data for array in arrays]
        different = self.functions.flat_replay(self._memory, *addresses, len(rows) - 1, seen.ctypes.data)
        return seen, int(different)

    def initial(self, heading: float, size: int) -> Array:
        """The controller of a vehicle that stands with a heading, flat."""
        made = np.zeros(size)
        self.functions.flat_init(heading, made.ctypes.data)
        return made

    def entered(self, controller: Array, law: int, estimate: Array) -> Array:
        """The controller with a law put in force about the exported design, flat."""
        made = controller.copy()
        self.functions.flat_enter(self._memory, law, np.ascontiguousarray(estimate).ctypes.data, made.ctypes.data)
        return made


__all__ = ["FLAGS", "FlatController", "compiler", "run_compiler", "shared_library"]
