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
from sitl.export.builds import COUNTING, FLY, M7, NAVIGATE, ReplayProgram, write_flight, write_navigation
from sitl.export.flown_again import record
from sitl.export.random_navigation import random_navigation
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.avionics import Navigation
from sitl.simulation.start import whole_periods
from tests.support import exported
from tests.support.digests.reference_flights import FLIGHTS, SHORT

ROOTS = ("darko_step", "darko_enter", "darko_values", "darko_estimator_read", "darko_estimator_step")
NAVIGATED = 0.8  # [s]

controller_folder: Any = exported.folder  # tests bear no types
estimator_folder: Any = exported.estimator_folder


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


def prepared(folder: Path, place: Path, what: str) -> ReplayProgram:
    """Print the code's size and stack; gives the program that counts."""
    source = folder / ("darko_estimator.c" if what == NAVIGATE else "darko_controller.c")
    run([*M7, *STRICT, "-O2", "-fcallgraph-info=su", "-c", str(source), "-o", "stack.o"], place)
    print(run(["arm-none-eabi-size", "stack.o"], place).splitlines()[1].split()[0], "bytes of code")
    print("bytes of stack:", deepest(place))
    return ReplayProgram(COUNTING, folder, place, what)


def counts(program: ReplayProgram) -> str:
    """Counts that the program prints."""
    return program.run().splitlines()[-1].partition(": ")[2]


def main() -> int:
    """Print what is measured."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--float32", action="store_true", help="in single precision")
    options.add_argument("--estimator", action="store_true", help="of the navigation filter")
    args = options.parse_args()
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        if args.estimator:
            navigated = random_navigation(3, NAVIGATED, exported.AIRFRAME, load_sensors(), Navigation.SENSORS)
            program = prepared(estimator_folder(single=args.float32), place, NAVIGATE)
            write_navigation(place, navigated)
            print(f"{navigated.name}:", counts(program))
            return 0
        program = prepared(controller_folder(single=args.float32), place, FLY)
        for flight in FLIGHTS:
            asks = [(whole_periods(ask.time), ask.do) for ask in flight.asks]
            write_flight(place, record(flight.name, flight.begin(), whole_periods(SHORT), asks))
            print(f"{flight.name}:", counts(program), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
