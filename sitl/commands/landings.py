"""Landings in wind and gusts, and how they end."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sitl.defaults import AIRFRAME
from sitl.errors import SitlError

if TYPE_CHECKING:
    from sitl.studies.landings import Landing

MIN_UPRIGHT = 0.98  # share of the landings


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl landings``."""
    options = argparse.ArgumentParser(prog="darko-sitl landings", description=commands["landings"] + ".")
    options.add_argument("--flights", type=int, default=100, metavar="N", help="how many landings [100]")
    options.add_argument("--first", type=int, default=1, metavar="SEED", help="seed of the first [1]")
    options.add_argument("--jobs", type=int, default=2, metavar="N", help="processes at once [2]")
    options.add_argument("--wind", type=float, default=5.0, metavar="M/S", help="maximum steady wind [5]")
    options.add_argument("--gusts", type=float, default=0.5, metavar="RMS", help="gusts per axis, m/s rms [0.5]")
    options.add_argument("--airframe", default=AIRFRAME, metavar="SET", help=f"parameter set or TOML file [{AIRFRAME}]")
    options.add_argument("--json", type=Path, metavar="FILE", help="also write every landing as JSON")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly the landings and print their figures; exit code 1 if too few end upright or one bounces for too long."""
    _check(args)
    from sitl.studies import landings  # noqa: PLC0415 - --help must not load the compiler

    results = landings.run(args.flights, args.first, args.airframe, args.wind, args.gusts, args.jobs)
    print("\n".join(landings.summary(results)), flush=True)
    if args.json is not None:
        try:
            args.json.write_text(json.dumps([r._asdict() for r in results], indent=1) + "\n", encoding="utf-8")
        except OSError as error:
            raise SitlError(f"{args.json}: {error.strerror}") from error
    return 0 if passed(results) else 1


def passed(results: Sequence[Landing]) -> bool:
    """Whether enough landings end upright and none bounces for long."""
    from sitl.studies.landings import MAX_BOUNCE, LandingEnd, count  # noqa: PLC0415

    steady = all(result.bounce <= MAX_BOUNCE for result in results)
    return steady and count(results, LandingEnd.UPRIGHT) >= MIN_UPRIGHT * len(results)


def _check(args: argparse.Namespace) -> None:
    """Refuse bad arguments before any flight."""
    if args.flights < 1 or args.jobs < 1:
        raise SitlError(f"--flights {args.flights}, --jobs {args.jobs}: both must be at least 1")
    if args.first < 0:
        raise SitlError(f"--first {args.first}: seeds are not negative")
    for name, maximum in (("wind", 30.0), ("gusts", 10.0)):
        value = getattr(args, name)
        if not 0.0 <= value <= maximum:
            raise SitlError(f"--{name} {value:g} is not within 0 and {maximum:g}")
    if args.json is not None and not args.json.parent.is_dir():
        raise SitlError(f"{args.json}: there is no folder {args.json.parent}")
