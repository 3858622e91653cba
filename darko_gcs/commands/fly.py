"""Scripted flights."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from pathlib import Path

from darko_gcs.commands.options import add_link_options, sitl_arguments

EXAMPLES = """\
examples:
  darko-gcs fly --mission square.plan --sitl --headless --speed 10
  darko-gcs fly --mission square.waypoints --headless --json     on a vehicle that is already running

exit codes: 0 flown and landed; 2 a file or an argument; 3 no link or no vehicle; 4 the flight ended early.
"""


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs fly``."""
    made = argparse.ArgumentParser(
        prog="darko-gcs fly",
        description=commands["fly"] + ".",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument("--mission", type=Path, required=True, metavar="FILE", help=".plan or QGC WPL 110 file")
    made.add_argument("--headless", action="store_true", help="without a screen; else the ground station opens on it")
    made.add_argument("--json", action="store_true", help="print the summary for a program")
    made.add_argument(
        "--timeout",
        type=_seconds,
        default=3600.0,
        metavar="S",
        help="give up after this many seconds of the vehicle's time",
    )
    add_link_options(made)
    return made


def _seconds(text: str) -> float:
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text} is no time to wait for")
    return value


def run(args: argparse.Namespace) -> int:
    """Fly the mission and print how it went."""
    if not args.headless:
        from darko_gcs.commands import connect  # noqa: PLC0415 - the screens are not needed otherwise

        return int(connect.run(args))
    import asyncio  # noqa: PLC0415 - --help must stay quick

    from darko_gcs.headless import fly_headless  # noqa: PLC0415

    summary = asyncio.run(fly_headless(args, sitl_arguments(args)))
    print(summary.as_json() if args.json else summary.as_text())
    return 0
