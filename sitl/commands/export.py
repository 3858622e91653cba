"""``darko-sitl export``: the controller that flies as C, and the proof that it is the same."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import counting_number, positive_number
from sitl.commands.airframe import tell_warnings
from sitl.defaults import AIRFRAME


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl export``."""
    options = CommandParser(prog="darko-sitl export", description=commands["export"] + ".")
    subcommands = options.add_subparsers(dest="subcommand", required=True, metavar="WHAT", title="what is done")
    written = "write the controller as readable C99"
    c = subcommands.add_parser("c", help=written, description=written + ".")
    c.add_argument("folder", type=Path, metavar="DIR", help="where to; made if it is not there")
    c.add_argument(
        "--for",
        dest="autopilot",
        choices=("plain", "paparazzi", "px4"),
        default="plain",
        help="with the module of an autopilot around it [plain]",
    )
    c.add_argument("--float32", action="store_true", help="in single precision")
    c.add_argument(
        "--estimator",
        choices=("sensors", "mocap"),
        help="the navigation filter too, aided by satellites, compass and barometer, or by motion capture",
    )
    c.add_argument(
        "--sensors",
        metavar="FILE",
        help="with --estimator: TOML file that overrides values of the sensors, or 'truthful'",
    )
    _add_common(c)
    flown = "compile the files of a folder and fly recorded flights by them: the same bits, or how far apart"
    check = subcommands.add_parser("check", help=flown, description=flown + ".")
    check.add_argument("folder", type=Path, metavar="DIR", help="where darko-sitl export c wrote")
    check.add_argument("--flights", type=counting_number, default=20, metavar="N", help="flights of chance [20]")
    check.add_argument("--seed", type=int, default=1, metavar="N", help="of the flights [1]")
    check.add_argument("--seconds", type=positive_number, default=2.0, metavar="S", help="of each [2]")
    check.add_argument(
        "--builds",
        choices=("here", "all"),
        default="here",
        help="the compiler that is here, or gcc and clang at -O0 and -O2, AArch64 and Cortex-M7 under QEMU [here]",
    )
    _add_common(check)
    return options


def _add_common(options: argparse.ArgumentParser) -> None:
    options.add_argument(
        "--airframe", default=AIRFRAME, metavar="FILE", help=f"a shipped set or a TOML file [{AIRFRAME}]"
    )
    options.add_argument(
        "--register", default="", metavar="MODULE:NAME", help="a Register of your own laws; of the vehicle's by default"
    )


def run(args: argparse.Namespace) -> int:
    """Write the files, or check them."""
    tell_warnings(args.airframe)
    from sitl.export import tasks  # noqa: PLC0415 - --help must not load the compiler

    return tasks.write(args) if args.subcommand == "c" else tasks.check(args)
