"""Airframe parameter sets: list them, show one, or print and draw its trims."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import finite_number
from sitl.errors import SitlError


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl airframe``."""
    options = CommandParser(prog="darko-sitl airframe", description=commands["airframe"] + ".")
    options.add_argument(
        "name", nargs="?", help="a shipped set or a TOML file; without a name the sets are listed; check: see FILE"
    )
    options.add_argument(
        "file",
        nargs="?",
        help="after check: a set or TOML file to be checked and flown: thrust, authority, trims, hold, leg, landing; "
        "exit code 1 if something is too small",
    )
    options.add_argument("--seed", type=int, default=1, metavar="N", help="with check: of wind and instruments [1]")
    options.add_argument(
        "--around",
        action="store_true",
        help="with check: instead, vehicles similar to it from 0.15 to 5 kg, and its constants a fifth off",
    )
    options.add_argument("--trims", action="store_true", help="print trims from 0 to 25 m/s, with their margins")
    options.add_argument(
        "--climb", type=finite_number, metavar="DEG", help="with --trims: climb angle (negative: descent) [0]"
    )
    turn = options.add_mutually_exclusive_group()
    turn.add_argument("--turn", type=finite_number, metavar="DEG/S", help="with --trims: turn rate to the left [0]")
    turn.add_argument("--bank", type=finite_number, metavar="DEG", help="with --trims: bank of a left turn")
    options.add_argument(
        "--plot",
        type=Path,
        metavar="FILE",
        help="with --trims: also draw climbs, turns and braking: .png, .svg or .pdf",
    )
    return options


def tell_warnings(name: str | None) -> None:
    """Print on stderr what is doubtful of an airframe that a command names, if it names one."""
    if not name:
        return
    from sitl.model.airframe_files import AirframeError, load  # noqa: PLC0415 - --help must not load the compiler

    with suppress(AirframeError):  # one that cannot be flown is told where it is to fly
        for text in load(name).warnings:
            print(f"darko-sitl: warning: {text}", file=sys.stderr)


def run(args: argparse.Namespace) -> int:
    """List the shipped sets, show one, or check one by numbers and flights."""
    if args.name == "check":
        return _check(args)
    if args.file is not None:
        raise SitlError(f"{args.file!r} after {args.name!r}: only check takes two words")
    tell_warnings(args.name)
    from sitl.lab.studies.trim_study import show_airframe  # noqa: PLC0415 - --help must not load the compiler

    return show_airframe(args)


def _check(args: argparse.Namespace) -> int:
    if args.file is None:
        raise SitlError("check needs a set or a file: darko-sitl airframe check FILE")
    tell_warnings(args.file)
    if args.around:
        from sitl.lab.studies.airframe_around import run_around  # noqa: PLC0415 - --help must not load the compiler

        return run_around(args)
    from sitl.lab.studies.airframe_check import run_check  # noqa: PLC0415 - --help must not load the compiler

    return run_check(args)
