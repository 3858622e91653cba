"""``darko-gcs log``: recorded flights, here and on the vehicle."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from darko_gcs.commands.log_commands import export, fetch, info, page, play, plot
from protocol.tools.command_line import CommandParser

__all__ = ["parser", "run"]


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs log``."""
    parser = CommandParser(prog="darko-gcs log", description=commands["log"] + ".")
    subcommands = parser.add_subparsers(dest="subcommand", required=True, metavar="info|report|plot|export|play|fetch")
    for name, module, text in (
        ("info", info, "summarise one log: vehicles, flight, messages, damage"),
        (
            "report",
            page,
            "write a page about a flight: path, V and jumps, actuators, energy, errors, events",
        ),
        ("plot", plot, "plot quantities of a log, in the terminal or as a picture"),
        ("export", export, "write a log as CSV, Parquet, KML or MCAP"),
        ("play", play, "send a log to another ground station, as if the vehicle flew now"),
        ("fetch", fetch, "download the logs that a vehicle has recorded itself"),
    ):
        subcommand = subcommands.add_parser(name, help=text)
        module.configure(subcommand)
        subcommand.set_defaults(module=module)
    return parser


def run(args: argparse.Namespace) -> int:
    """Run the subcommand.

    Raises:
        GroundError: If it fails.
    """
    from darko_gcs.errors import GroundError  # noqa: PLC0415
    from protocol.errors import ProtocolError  # noqa: PLC0415 - --help must not load the wire

    try:
        return int(args.module.run(args))
    except ProtocolError as error:
        raise GroundError(str(error)) from error
