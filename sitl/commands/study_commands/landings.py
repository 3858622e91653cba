"""Landings in wind and gusts, and how they end."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from protocol.tools.option_values import finite_number
from sitl.commands.study_commands.seeded_options import check_seeded, craft_of, seeded_parser, write_json

if TYPE_CHECKING:
    from sitl.studies.landings import Landing

MIN_UPRIGHT = 0.98  # share of the landings


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl landings``."""
    options = seeded_parser("landings", commands["landings"], 100, "how many landings")
    options.add_argument("--wind", type=finite_number, default=5.0, metavar="M/S", help="maximum steady wind [5]")
    options.add_argument(
        "--gusts", type=finite_number, default=0.5, metavar="RMS", help="gusts per axis, m/s rms [0.5]"
    )
    return options


def run(args: argparse.Namespace) -> int:
    """Fly the landings and print their figures; exit code 1 if too few end upright or one bounces for too long."""
    check_seeded(args, {"wind": 30.0, "gusts": 10.0})
    from sitl.studies import landings  # noqa: PLC0415 - --help must not load the compiler

    results = landings.run(args.flights, args.first, craft_of(args), args.wind, args.gusts, args.jobs)
    print("\n".join(landings.summary(results)), flush=True)
    if args.json is not None:
        write_json(args.json, [landing._asdict() for landing in results])
    return 0 if passed(results) else 1


def passed(results: Sequence[Landing]) -> bool:
    """Whether enough landings end upright and none bounces for long."""
    from sitl.studies.landings import MAX_BOUNCE, LandingEnd, count  # noqa: PLC0415

    steady = all(result.bounce <= MAX_BOUNCE for result in results)
    return steady and count(results, LandingEnd.UPRIGHT) >= MIN_UPRIGHT * len(results)
