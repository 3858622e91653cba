"""``darko-gcs signing``: change the vehicle's signing key."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from darko_gcs.commands.options import add_listen_options
from protocol.tools.command_line import command_parser, print_json

_EXAMPLES = """\
examples:
  darko-gcs signing --signing-key old.key --new-key new.key

The vehicle must be on this machine: the key is readable on the link. The old key stays in force until the vehicle
signs with the new one. Give a vehicle its first key with darko-gcs --signing-key KEY --give-key.

exit codes: 0 changed; 2 a key, or a link that is not loopback; 3 no vehicle, or it did not accept the new key.
"""


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs signing``."""
    parser = command_parser("darko-gcs signing", commands, _EXAMPLES)
    parser.add_argument("--new-key", required=True, metavar="KEY", help="64 hexadecimal digits or a file with them")
    parser.add_argument("--json", action="store_true", help="print the result, or the failure, as JSON")
    add_listen_options(parser.add_argument_group("link"))
    return parser


def run(args: argparse.Namespace) -> int:
    """Change the key, and report it.

    Raises:
        GroundError: The key was not changed; the message says why.
    """
    import asyncio

    from darko_gcs.tasks.key_change import change_key

    system, component = asyncio.run(change_key(args))
    if args.json:
        print_json({"ok": True, "vehicle": {"system": system, "component": component}})
    else:
        print(f"vehicle {system}/{component} signs with the new key: start every ground station with it from now on")
    return 0
