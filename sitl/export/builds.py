"""Exported files compiled for several processors, and recorded flights flown once more by each of them.

A flight is recorded once and written into a file; a build is a program that reads it and tells what differs.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from shutil import which
from typing import NamedTuple, TypeVar

import numpy as np

from sitl.export.build import STRICT, WARNINGS, run_compiler
from sitl.export.c_types import ExportError
from sitl.export.flown_again import RecordedFlight
from sitl.export.navigated_again import RecordedNavigation
from sitl.export.templates import template
from sitl.model.airframe import Array

FLY, NAVIGATE = "darko_replay", "darko_navigate"
_COMPILED_WITH = {FLY: "darko_controller.c", NAVIGATE: "darko_estimator.c"}
PATIENCE = 600.0  # for one flight [s]
Recorded = TypeVar("Recorded", RecordedFlight, RecordedNavigation)


class Build(NamedTuple):
    """A compiler, its options, and what runs the programs that it makes."""

    name: str
    compiler: tuple[str, ...]
    runner: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()  # besides

    @property
    def missing(self) -> str:
        """The first program of it that is not installed; empty if all are."""
        return next((name for name in (self.compiler[0], *self.runner[:1]) if not which(name)), "")


# A board without an operating system: vectors at 0, code behind them, data in RAM; files and texts by semihosting.
M7 = ("arm-none-eabi-gcc", "-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard", "-fno-math-errno")
BARE = ("--specs=rdimon.specs", "-Wl,--section-start=.vectors=0x0", "-Wl,-Tdata=0x20000000")
BOARD = ("qemu-system-arm", "-M", "mps2-an500", "-nographic", "-semihosting")
COUNTING = Build(  # one instruction is a nanosecond
    "counting Cortex-M7",
    (*M7, *BARE, "-O2", "-DCOUNT_TICKS=instructions"),
    (*BOARD, "-icount", "shift=0", "-kernel"),
    ("cortex_m7.c",),
)
AARCH64 = ("aarch64-linux-gnu-gcc", "-static")
BUILDS = (
    *(Build(f"{cc} {level}, x86-64", (cc, level)) for cc in ("gcc", "clang") for level in ("-O0", "-O2")),
    Build("gcc -O2, AArch64", (*AARCH64, "-O2"), ("qemu-aarch64",)),
    Build("gcc -O2, Cortex-M7", (*M7, *BARE, "-O2"), (*BOARD, "-kernel"), ("cortex_m7.c",)),
)


class ReplayProgram:
    """A build of exported files that flies, or navigates, recorded flights once more.

    Args:
        build: How it is compiled and run.
        folder: Of the exported files.
        place: Where its own files are.
        what: ``FLY`` or ``NAVIGATE``.

    Raises:
        ExportError: If it cannot be compiled.
    """

    def __init__(self, build: Build, folder: Path, place: Path, what: str = FLY) -> None:
        """Compile it."""
        self.name, self._place = build.name, place
        own = [f"{what}.c", *build.sources]
        for name in own:
            (place / name).write_text(template(f"replay/{name}"), encoding="utf-8")
        made = place / f"{what} {build.name}"
        sources = [str(path) for path in (*(place / name for name in own), folder / _COMPILED_WITH[what])]
        run_compiler([*build.compiler, *STRICT, *WARNINGS, "-I", str(folder), "-o", str(made), *sources, "-lm"])
        self._command = (*build.runner, str(made))

    def run(self) -> str:
        """Its words about the flight that was written there.

        Raises:
            ExportError: If it does not end.
        """
        try:
            ran = subprocess.run(  # noqa: S603 - what was compiled here
                self._command, cwd=self._place, capture_output=True, text=True, check=False, timeout=PATIENCE
            )
        except subprocess.TimeoutExpired as error:
            raise ExportError(f"{self.name}: no end of a flight within {PATIENCE:.0f} s") from error
        return (ran.stdout + ran.stderr).strip()


def flown_by_all(
    folder: Path,
    what: str,
    flights: Iterable[Recorded],
    write: Callable[[Path, Recorded], str],
    builds: Iterable[Build] = BUILDS,
) -> int:
    """Fly each flight by each build, print which differ, and by each build how many do not.

    Args:
        folder: Of the exported files.
        what: ``FLY`` or ``NAVIGATE``.
        flights: Recorded.
        write: Writes one for programs, and gives what a program says that does the same.
        builds: Those that are not installed are left out, and told of.

    Returns:
        1 if a flight differs, or no build is installed.

    Raises:
        ExportError: If the files cannot be compiled, or a program does not end.
    """
    flown = 0
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        programs = [ReplayProgram(build, folder, place, what) for build in installed(builds)]
        same = dict.fromkeys((program.name for program in programs), 0)
        for flight in flights:
            flown += 1
            expected = write(place, flight)
            for program in programs:
                said = program.run()
                same[program.name] += said == expected
                if said != expected:
                    print(f"{flight.name} by {program.name}: {said or 'no word'}", flush=True)
    done = "navigated" if what == NAVIGATE else "flown"
    for name, count in same.items():
        print(f"{name}: {count} of {flown} flights {done} the same to the bit")
    return 0 if same and min(same.values()) == flown else 1


def installed(builds: Iterable[Build]) -> Iterator[Build]:
    """Builds whose programs are there; of the others a line is printed."""
    for build in builds:
        if build.missing:
            print(f"{build.name}: left out, {build.missing} is not installed")
        else:
            yield build


def write_flight(place: Path, flight: RecordedFlight) -> str:
    """Write a flight for programs that fly it; gives what those say that do the same to the bit."""
    rows = np.concatenate([flight.rows, flight.controllers], axis=1)
    _write(place / "replay.bin", [len(rows) - 1], flight.design, flight.begin, rows)
    return f"{len(rows) - 1} periods: 0 numbers differ, 0 steps"


def write_navigation(place: Path, flight: RecordedNavigation) -> str:
    """Write a flight for programs that navigate it; gives what those say that do the same to the bit."""
    head = [len(flight.rows), flight.period, float(flight.has_tube)]
    rows = np.concatenate([flight.rows, flight.estimates], axis=1)
    _write(place / "navigation.bin", head, flight.filter, flight.instruments, flight.steps, flight.end, rows)
    return f"{len(rows)} periods: 0 numbers differ"


def _write(path: Path, *parts: Array | list[float]) -> None:
    path.write_bytes(np.concatenate([np.ravel(part) for part in parts]).astype("<f8").tobytes())
