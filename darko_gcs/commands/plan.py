"""``darko-gcs plan``: for scripts: where the vehicle's flight plan is, its blocks, and what an operator asks of it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from darko_gcs.commands.options import add_listen_options
from protocol.tools.command_line import command_parser
from protocol.tools.option_values import finite_number

_EXAMPLES = """\
examples:
  darko-gcs plan status --json
  darko-gcs plan jump Takeoff
  darko-gcs plan move STDBY 1.0 -0.5        east and north of the plan's origin; its height stays
  darko-gcs plan set laps 3
  darko-gcs plan load room.xml               or a shipped one: voliere; then: darko-gcs plan fly

There is no confirmation: the request is sent at once.
No other ground station may listen on the same port meanwhile.

exit codes: 0 done; 2 an argument, or refused by the vehicle; 3 no vehicle.
"""


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs plan``."""
    parser = command_parser("darko-gcs plan", commands, _EXAMPLES)
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--json", action="store_true", help="print JSON")
    add_listen_options(common.add_argument_group("link"))
    acts = parser.add_subparsers(dest="act", required=True, metavar="ACT")
    acts.add_parser("status", parents=[common], help="block, stage, times, waypoints, variables, what happened")
    acts.add_parser("blocks", parents=[common], help="the blocks with their keys")
    acts.add_parser("fly", parents=[common], help="fly the plan from the block that it is in")
    jump = acts.add_parser("jump", parents=[common], help="enter a block")
    jump.add_argument("block", help="its name or number")
    move = acts.add_parser("move", parents=[common], help="put a waypoint elsewhere")
    move.add_argument("waypoint", help="its name")
    move.add_argument("east", type=finite_number, help="of the plan's origin [m]")
    move.add_argument("north", type=finite_number, help="of the plan's origin [m]")
    move.add_argument("up", type=finite_number, nargs="?", help="[m]; without it, the height stays")
    load = acts.add_parser("load", parents=[common], help="load a flight plan onto the vehicle, which must be disarmed")
    load.add_argument("file", type=Path, help="Paparazzi flight plan; procedures lie beside or below it")
    load.add_argument(
        "--names", type=Path, metavar="FILE", help="TOML file: maps names of the Paparazzi build to DarkO's"
    )
    load.add_argument(
        "--procedures", type=Path, metavar="DIR", help="another folder that procedures it includes may lie in"
    )
    change = acts.add_parser("set", parents=[common], help="set a variable")
    change.add_argument("variable", help="its name")
    change.add_argument("value", type=finite_number)
    return parser


def run(args: argparse.Namespace) -> int:
    """Do it, and print the result.

    Raises:
        GroundError: The vehicle has no such thing, refused, or did not answer; the message says which.
    """
    import asyncio

    from darko_gcs.tasks.plan_request import request_of_plan

    print(asyncio.run(request_of_plan(args)))
    return 0
