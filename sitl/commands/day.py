"""A day under the net, from one file."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import whole_number


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl day``."""
    options = CommandParser(
        prog="darko-sitl day",
        description=commands["day"] + ".",
        epilog="The same day live, for a ground station: darko-sitl --day FILE. Exit codes: 0 flown as written; "
        "1 crashed, or a request was refused; 2 a file or an argument.",
    )
    options.add_argument("file", type=Path, metavar="FILE", help="the day, a TOML file (docs/day.md)")
    options.add_argument("--seed", type=whole_number, metavar="N", help="another seed [the file's]")
    options.add_argument("--out", type=Path, metavar="PAGE", help="the page to write [NAME.html in this folder]")
    options.add_argument("--log", type=Path, metavar="FILE", help="also keep the flight's telemetry log (.tlog)")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly the day and write its page."""
    from sitl.day import run_day  # noqa: PLC0415 - --help must not load the compiler

    return run_day(args)
