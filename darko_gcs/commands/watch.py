"""``darko-gcs watch``: what the vehicle reports, a line at a time."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from darko_gcs.commands.options import EXIT_CODES, add_script_options, run_script
from protocol.tools.command_line import command_parser
from protocol.tools.option_values import natural_number, positive_number

if TYPE_CHECKING:
    from darko_gcs.scripting import Vehicle


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs watch``."""
    parser = command_parser(
        "darko-gcs watch",
        commands,
        f"With --json each line is a JSON object: positions NED in metres, angles in degrees.\n\n{EXIT_CODES}",
    )
    parser.add_argument(
        "--count", type=natural_number, default=0, metavar="N", help="lines to print; 0: until interrupted [0]"
    )
    parser.add_argument("--every", type=positive_number, default=1.0, metavar="S", help="time between lines [1]")
    add_script_options(parser)
    return parser


def run(args: argparse.Namespace) -> int:
    """Print lines until there are enough.

    Raises:
        GroundError: No vehicle is heard, or an argument is wrong.
    """
    from darko_gcs.errors import GroundError

    if not 0.01 <= args.every <= 3600.0 or args.count < 0:
        raise GroundError("--every takes 0.01 to 3600 s, --count no negative number")
    if args.count:
        args.timeout += args.count * args.every
    else:
        args.timeout = 1e9
    return run_script(args, lambda vehicle: _watch(vehicle, args), lambda result: f"{result['lines']} lines")


async def _watch(vehicle: Vehicle, args: argparse.Namespace) -> dict[str, Any]:
    import json

    from darko_gcs.scripting.link_session import report

    lines = 0
    async for s in vehicle.reports(1.0 / args.every):
        seen = report(s)
        print(json.dumps(seen) if args.json else _line(seen), flush=True)
        lines += 1
        if lines == args.count:
            break
    return {"lines": lines}


def _line(seen: dict[str, Any]) -> str:
    place = "?" if seen["position"] is None else "N {:.1f} E {:.1f} D {:.1f} m".format(*seen["position"])
    battery = "" if seen["battery"] is None else f"  battery {100 * seen['battery']:.0f} %"
    armed = {True: "armed", False: "disarmed", None: "?"}[seen["armed"]]
    return (
        f"{seen['time'] or 0.0:8.1f} s  {seen['mode'] or '?':<12} {armed:<8}  {seen['law'] or '':<22} {place}{battery}"
    )
