"""``darko-gcs fly``: scripted flights."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from darko_gcs.commands.options import (
    add_link_options,
    add_screen_options,
    add_verify_option,
    checked_sitl_arguments,
    listening_port,
    refuse_screen_options,
)
from protocol.tools.command_line import command_parser, print_json
from protocol.tools.option_values import positive_number

_EXAMPLES = """\
examples:
  darko-gcs fly --mission square.plan --sitl --headless --speed 10
  darko-gcs fly --mission square.waypoints --headless --json     on a vehicle that is already running

exit codes: 0 flown and landed; 2 a file or an argument; 3 no link or no vehicle; 4 the flight ended early.
"""


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs fly``."""
    parser = command_parser("darko-gcs fly", commands, _EXAMPLES)
    parser.add_argument("--mission", type=Path, required=True, metavar="FILE", help=".plan or QGC WPL 110 file")
    parser.add_argument("--headless", action="store_true", help="fly without a screen; else the ground station opens")
    parser.add_argument("--json", action="store_true", help="print the result, or the failure, as JSON")
    parser.add_argument(
        "--timeout",
        type=positive_number,
        default=3600.0,
        metavar="S",
        help="maximum flight time, vehicle's time in s [3600]",
    )
    add_verify_option(parser)
    add_screen_options(parser)
    add_link_options(parser)
    return parser


def run(args: argparse.Namespace) -> int:
    """Fly the mission and print the result.

    Raises:
        GroundError: If the file, the link, the vehicle or the flight fails.
    """
    if not args.headless:
        from darko_gcs.commands.connect import open_screens

        code = open_screens(args)
        if args.json:
            print_json({"ok": code == 0, "command": "fly", "exit_code": code})
        return code
    refuse_screen_options(args)
    import asyncio

    from darko_gcs.tasks.headless_flight import fly_headless

    args.port = listening_port(args)
    result = asyncio.run(fly_headless(args, checked_sitl_arguments(args)))
    if args.json:
        print_json({"ok": True, **vars(result)}, indent=1)
    else:
        print(result.as_text())
    return 0
