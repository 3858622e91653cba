"""Parameter sets."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sitl.kernels.parameters import Airframe


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl airframe``."""
    made = argparse.ArgumentParser(prog="darko-sitl airframe", description=commands["airframe"] + ".")
    made.add_argument("name", nargs="?", help="a shipped set or a TOML file; without one the sets are listed")
    made.add_argument("--trims", action="store_true", help="level trims from 0 to 25 m/s instead, with their margins")
    return made


def run(args: argparse.Namespace) -> int:
    """List the shipped sets, or check and show one."""
    from sitl.airframe import available, load  # noqa: PLC0415 - --help must not load the compiler

    if args.name is None:
        for name in available():
            print(f"{name:<22}{load(name).description}")
        return 0
    airframe = load(args.name)
    if args.trims:
        print("\n".join(_trims(airframe.parameters)))
        return 0
    print(f"{airframe.name}: {airframe.description}\n{airframe.path} sha256 {airframe.sha256}")
    for key, entry in airframe.values.items():
        print(f"  {key:<16}{entry.value!s:>14} {entry.unit:<10} {entry.source}")
    return 0


def _trims(a: Airframe) -> Iterator[str]:
    from sitl.design.trim import level_trim  # noqa: PLC0415 - --help must not load the compiler

    yield "V [m/s]  nose [deg]  thrust [N]  elevon [deg]  motor [rad/s]  elevon left [deg]"
    for speed in range(26):
        trim = level_trim(a, float(speed))
        numbers = (
            f"{math.degrees(trim.theta):12.1f}{trim.thrust:12.3f}{math.degrees(trim.delta):14.1f}{trim.omega:15.0f}"
        )
        missing = "" if trim.exists else "   none within the limits"
        yield f"{speed:7d}{numbers}{math.degrees(trim.margin):19.1f}{missing}"
