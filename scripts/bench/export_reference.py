"""The reference flights of the tests, whole, flown once more by every build of an export: the same bits.

``python -m scripts.bench.export_reference [--builds NAME ...]``, from the project's folder: the laws are exported anew.
It takes two minutes of a processor.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from typing import Any

from sitl.export.builds import BUILDS, FLY, flown_by_all, write_flight
from sitl.export.flown_again import RecordedFlight, record
from sitl.simulation.start import whole_periods
from tests.support import exported
from tests.support.digests.reference_flights import FLIGHTS

folder: Any = exported.folder  # tests bear no types


def flights(told: list[int]) -> Iterator[RecordedFlight]:
    """The flights, recorded one after the other; periods and jumps of each are added to what is told."""
    for flight in FLIGHTS:
        asks = [(whole_periods(ask.time), ask.do) for ask in flight.asks]
        made = record(flight.name, flight.begin(), whole_periods(flight.seconds), asks)
        told[0] += len(made.rows) - 1
        told[1] += made.jumps
        yield made


def main() -> int:
    """Fly and print."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [build.name for build in BUILDS]
    options.add_argument("--builds", nargs="*", choices=names, default=names, metavar="NAME", help=", ".join(names))
    args = options.parse_args()
    told = [0, 0]
    builds = [build for build in BUILDS if build.name in args.builds]
    wrong = flown_by_all(folder(), FLY, flights(told), write_flight, builds)
    print(f"{told[0]} periods, {told[1]} jumps")
    return wrong


if __name__ == "__main__":
    sys.exit(main())
