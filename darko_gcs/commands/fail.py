"""``darko-gcs fail``: have something fail on the vehicle, to see what it does."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from darko_gcs.commands.options import add_listen_options
from protocol.tools.command_line import command_parser, print_json
from protocol.tools.option_values import whole_number

_EXAMPLES = """\
examples:
  darko-gcs fail gps off
  darko-gcs fail motor stuck --instance 1    the left one
  darko-gcs fail gps ok                      clears the failure

The vehicle's parameter SYS_FAILURE_EN must be 1. No other ground station may listen on the same port meanwhile.

exit codes: 0 accepted; 2 an argument, or refused by the vehicle; 3 no vehicle.
"""


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs fail``."""
    from protocol.names import FAILURE_TYPES, FAILURE_UNITS

    parser = command_parser("darko-gcs fail", commands, _EXAMPLES)
    parser.add_argument("unit", choices=list(FAILURE_UNITS), help="what fails")
    parser.add_argument("failure", choices=list(FAILURE_TYPES), help="how; ok clears the failure")
    parser.add_argument("--instance", type=whole_number, default=0, metavar="N", help="1 left, 2 right; 0: all [0]")
    parser.add_argument("--json", action="store_true", help="print the result, or the failure, as JSON")
    add_listen_options(parser.add_argument_group("link"))
    return parser


def run(args: argparse.Namespace) -> int:
    """Ask for the failure, and print the answer.

    Raises:
        GroundError: The vehicle refused or did not answer; the message says why.
    """
    import asyncio

    asyncio.run(_inject(args))
    if args.json:
        told = {"unit": args.unit, "failure": args.failure, "instance": args.instance, "result": "accepted"}
        print_json({"ok": True, **told})
    else:
        print(f"{args.unit} {args.failure}: accepted")
    return 0


async def _inject(args: argparse.Namespace) -> None:
    from darko_gcs.scripting import FlightError, GroundError, connect

    where = {"vehicle": args.vehicle, "signing_key": args.signing_key, "station": args.id}
    async with connect(args.host, args.port, **where) as vehicle:
        try:
            await vehicle.inject_failure(args.unit, args.failure, args.instance)
        except FlightError as error:  # nothing was flown: a refusal is one like that of an argument
            raise GroundError(str(error), **error.details) from error
