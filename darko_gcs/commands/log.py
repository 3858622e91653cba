"""``darko-gcs log``: recorded flights, here and on the vehicle."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from protocol.tools.command_line import CommandParser


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs log``."""
    parser = CommandParser(prog="darko-gcs log", description=commands["log"] + ".")
    subcommands = parser.add_subparsers(dest="subcommand", required=True, metavar="info|report|plot|export|play|fetch")
    for name, configure, run_it, text in (
        ("info", configure_info, run_info, "summarise one log: vehicles, flight, messages, damage"),
        (
            "report",
            configure_report,
            run_report,
            "write a page about a flight: path, V and jumps, actuators, energy, errors, events",
        ),
        ("plot", configure_plot, run_plot, "plot quantities of a log, in the terminal or as a picture"),
        ("export", configure_export, run_export, "write a log as CSV, Parquet, KML or MCAP"),
        ("play", configure_play, run_play, "send a log to another ground station, as if the vehicle flew now"),
        ("fetch", configure_fetch, run_fetch, "download the logs that a vehicle has recorded itself"),
    ):
        subcommand = subcommands.add_parser(name, help=text)
        configure(subcommand)
        subcommand.set_defaults(run=run_it)
    return parser


def run(args: argparse.Namespace) -> int:
    """Run the subcommand.

    Raises:
        GroundError: If it fails.
    """
    from darko_gcs.errors import GroundError
    from protocol.errors import ProtocolError

    try:
        return int(args.run(args))
    except ProtocolError as error:
        raise GroundError(str(error)) from error
