"""Cases of the shipped campaigns flown in doubles and by an export in floats: is any lost in one and not in the other?

``python -m scripts.bench.export_campaigns DIR [CAMPAIGN ...] --cases 40``, from the project's folder, of what
``darko-sitl export c DIR --float32 --estimator sensors --airframe collage`` wrote: the first cases of each campaign, by
the whole vehicle with its autopilot, on sensors (``throws``: laws alone, by the truth). Others have gains by their
delays or thresholds, or another airframe or navigation than the export.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from sitl.export.in_the_loop import ExportedRegister
from sitl.lab.campaigns.case_flights import FlownCase, fly_case
from sitl.lab.campaigns.specification import Specification, draw, load_specification
from sitl.simulation.dispatch import Register

EXPORTED = ("failures", "falls", "falls-calm", "holds", "landings", "legs", "liveness", "returns", "square", "throws")
JUDGED = 0.5  # a judgement is 1 or 0


def is_good(specification: Specification, flown: FlownCase) -> bool:
    """Whether a case is all that its campaign requires; nothing less than an end without error where it does not."""
    at = [list(specification.measures).index(name) for name in specification.require]
    return not flown.error and all(flown.measures[index] > JUDGED for index in at)


def compare(name: str, cases: int, register: Register) -> tuple[int, int, int, int]:
    """Fly cases of a campaign; gives how many, good ones in doubles and in floats, and those good in doubles alone."""
    specification = load_specification(name)
    began, good, lost = time.process_time(), [0, 0], 0
    n = min(cases, specification.cases)
    for number in range(n):
        case = draw(specification, number)
        ours, theirs = fly_case(specification, case), fly_case(specification, case, register)
        judged = [is_good(specification, one) for one in (ours, theirs)]
        good = [count + one for count, one in zip(good, judged, strict=True)]
        lost += judged == [True, False]
        if judged[0] != judged[1] or ours.end != theirs.end:
            print(f"{name} case {number}: {told(specification, ours)}; in floats {told(specification, theirs)}")
    print(
        f"{name}: {n} cases, good {good[0]} in doubles, {good[1]} in floats, {lost} lost by floats alone "
        f"({time.process_time() - began:.0f} s of processor)",
        flush=True,
    )
    return n, good[0], good[1], lost


def told(specification: Specification, flown: FlownCase) -> str:
    """A case's end and measures in words."""
    measures = zip(specification.measures, flown.measures, strict=True)
    values = ", ".join(f"{name} {value:.3g}" for name, value in measures if math.isfinite(value))
    return f"{flown.end}{f' ({flown.error})' if flown.error else ''}, {values}"


def main(words: Sequence[str] | None = None) -> int:
    """Fly and print; 1 if floats alone lose one."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("folder", type=Path, metavar="DIR")
    options.add_argument("campaigns", nargs="*", metavar="CAMPAIGN", help=f"[{' '.join(EXPORTED)}]")
    options.add_argument("--cases", type=int, default=40, metavar="N", help="of each campaign [%(default)s]")
    args = options.parse_args(words)
    register = ExportedRegister(args.folder)
    found = [compare(name, args.cases, register) for name in args.campaigns or EXPORTED]
    n, doubles, floats, lost = (sum(column) for column in zip(*found, strict=True))
    print(f"all: {n} cases, good {doubles} in doubles, {floats} in floats, {lost} lost by floats alone")
    return int(lost > 0)


if __name__ == "__main__":
    sys.exit(main())
