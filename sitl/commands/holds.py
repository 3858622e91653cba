"""Holds of a point in wind and gusts, from many seeds."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sitl.defaults import AIRFRAME
from sitl.errors import SitlError

if TYPE_CHECKING:
    from sitl.studies.holds import FlownHold

MODERATE_WIND, MODERATE_ACROSS, MODERATE_ABOVE = 5.0, 1.0, 0.7  # [m/s], [m], [m]: in no more wind, for 95 % of the time
STRONG_WIND, STRONG_ACROSS = 8.0, 3.0
HOLDS_PER_LINE = 10  # holds between two progress lines


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl holds``."""
    options = argparse.ArgumentParser(prog="darko-sitl holds", description=commands["holds"] + ".")
    options.add_argument("--wind", type=float, nargs="+", default=[3.0, 5.0, 8.0], metavar="M/S", help="winds [3 5 8]")
    options.add_argument("--gusts", type=float, default=1.0, metavar="RMS", help="gusts per axis, m/s rms [1]")
    options.add_argument("--parameters", type=float, default=0.0, metavar="SHARE", help="error of the design model [0]")
    options.add_argument("--flights", type=int, default=20, metavar="N", help="holds in each wind [20]")
    options.add_argument("--first", type=int, default=1, metavar="SEED", help="seed of the first [1]")
    options.add_argument("--airframe", default=AIRFRAME, metavar="SET", help=f"set or TOML file [{AIRFRAME}]")
    options.add_argument("--jobs", type=int, default=2, metavar="N", help="processes at once [2]")
    options.add_argument("--json", type=Path, metavar="FILE", help="also write every hold as JSON")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly the holds and print how far off they were; exit code 1 if one is farther off than it may be."""
    _check(args)
    from sitl.studies import holds  # noqa: PLC0415 - --help must not load the compiler

    seeds = range(args.first, args.first + args.flights)
    conditions = [holds.HoldConditions(s, wind, args.gusts, args.parameters) for wind in args.wind for s in seeds]
    flown = holds.run_holds(
        conditions, args.airframe, args.jobs, on_progress=lambda done: _print_progress(done, len(conditions))
    )
    print("\n".join(holds.summary(flown)), flush=True)
    if args.json is not None:
        _write(flown, args.json)
    return 0 if passed(flown) else 1


def passed(flown: Sequence[FlownHold]) -> bool:
    """Whether no hold ended, and each was as near as its wind allows."""
    return all(not hold.fault and _is_near(hold) for hold in flown)


def _is_near(hold: FlownHold) -> bool:
    if hold.wind <= MODERATE_WIND:
        return hold.across <= MODERATE_ACROSS and hold.above <= MODERATE_ABOVE
    return hold.wind > STRONG_WIND or hold.across <= STRONG_ACROSS


def _check(args: argparse.Namespace) -> None:
    if args.first < 0:
        raise SitlError(f"--first {args.first}: seeds are not negative")
    if args.flights < 1:
        raise SitlError(f"--flights {args.flights}: there must be one at least")
    for name, values, most in (("wind", args.wind, 30.0), ("gusts", [args.gusts], 10.0)):
        for value in values:
            if not 0.0 <= value <= most:
                raise SitlError(f"--{name} {value:g} is not within 0 and {most:g}")
    if not 0.0 <= args.parameters <= 0.5:
        raise SitlError(f"--parameters {args.parameters:g} is not within 0 and 0.5")
    if args.json is not None and not args.json.parent.is_dir():
        raise SitlError(f"{args.json}: there is no folder {args.json.parent}")


def _print_progress(done: int, of: int) -> None:
    if done % HOLDS_PER_LINE == 0 or done == of:
        print(f"{done}/{of} flown", file=sys.stderr, flush=True)


def _write(flown: Sequence[FlownHold], path: Path) -> None:
    try:
        path.write_text(json.dumps([hold._asdict() for hold in flown], indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise SitlError(f"{path}: {error.strerror}") from error
