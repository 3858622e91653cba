"""Demands of the exported code on a Cortex-M7: code, stack, instructions of a step, law by law or of the estimator.

python -m scripts.bench.export_cost [--float32] [--estimator], from the project's folder; it needs gcc-arm-none-eabi and
qemu-system-arm. QEMU counts instructions, not cycles: an M7 takes about one to two cycles for each, more where it
divides (a square root or a division in doubles: up to 32 cycles).
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from sitl.export.build import STRICT
from sitl.export.flown_again import record
from sitl.export.random_navigation import random_navigation
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.avionics import Navigation
from sitl.simulation.start import whole_periods
from tests.support import exported
from tests.support.digests.reference_flights import FLIGHTS, SHORT

M7 = ("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard", "-O2", "-fno-math-errno")
BARE = ("--specs=rdimon.specs", "-Wl,--section-start=.vectors=0x0", "-Wl,-Tdata=0x20000000")
BOARD = ("qemu-system-arm", "-M", "mps2-an500", "-nographic", "-semihosting", "-icount", "shift=0", "-kernel", "m7.elf")
ROOTS = ("darko_step", "darko_enter", "darko_values", "darko_estimator_read", "darko_estimator_step")
NAVIGATED = 0.8  # [s]
COMPILER = ("arm-none-eabi-gcc", *STRICT, *M7)

program: Any = exported.program  # tests bear no types
estimator_program: Any = exported.estimator_program


def run(command: list[str], place: Path) -> str:
    """Output of a program."""
    return subprocess.run(command, cwd=place, check=True, capture_output=True, text=True).stdout  # noqa: S603 - ours


def deepest(place: Path) -> dict[str, int]:
    """Bytes of stack below each function that a caller calls, by the compiler's call graph."""
    text = next(place.glob("*.ci")).read_text(encoding="utf-8")
    own = {name: int(size) for name, size in re.findall(r'node: \{ title: "([^"]+)" label: "[^"]*?(\d+) bytes', text)}
    calls: dict[str, set[str]] = {}
    for source, target in re.findall(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', text):
        calls.setdefault(source, set()).add(target)

    def depth(name: str) -> int:
        return own.get(name, 0) + max((depth(called) for called in calls.get(name, ())), default=0)

    return {name.rpartition(":")[2]: depth(name) for name in own if name.rpartition(":")[2] in ROOTS}


def prepare(place: Path, sources: list[str]) -> None:
    """Print the code's size and stack, and compile the program that counts."""
    run([*COMPILER, "-fcallgraph-info=su", "-c", sources[-1], "-o", "stack.o"], place)
    print(run(["arm-none-eabi-size", "stack.o"], place).splitlines()[1].split()[0], "bytes of code")
    print("bytes of stack:", deepest(place))
    counted = ["-DCOUNT_TICKS=instructions", *BARE, "-o", "m7.elf", *sources, "cortex_m7.c", "-lm"]
    run([*COMPILER, *counted], place)


def counts(place: Path) -> str:
    """Counts that the program prints."""
    flown = subprocess.run(BOARD, cwd=place, capture_output=True, text=True, check=False)  # noqa: S603 - ours
    return flown.stdout.splitlines()[-1].partition(": ")[2]


def main() -> int:
    """Print what is measured."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--float32", action="store_true", help="in single precision")
    options.add_argument("--estimator", action="store_true", help="of the navigation filter")
    args = options.parse_args()
    single = args.float32
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        if args.estimator:
            navigated = random_navigation(3, NAVIGATED, exported.AIRFRAME, load_sensors(), Navigation.SENSORS)
            prepare(place, estimator_program(place, navigated, single))
            print(f"{navigated.name}:", counts(place))
            return 0
        for number, flight in enumerate(FLIGHTS):
            asks = [(whole_periods(ask.time), ask.do) for ask in flight.asks]
            recorded = record(flight.name, flight.begin(), whole_periods(SHORT), asks)
            sources = program(place, recorded, single)
            if number == 0:
                prepare(place, sources)
            print(f"{flight.name}:", counts(place), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
