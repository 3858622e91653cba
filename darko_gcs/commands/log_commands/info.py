"""``darko-gcs log info``: summarise a telemetry log."""

from __future__ import annotations

import argparse
from pathlib import Path

from darko_gcs.commands.options import add_log_vehicle_option
from protocol.tools.option_values import whole_number


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log info``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="telemetry log (.tlog)")
    parser.add_argument("--texts", type=whole_number, default=10, metavar="N", help="show the last N status texts [10]")
    add_log_vehicle_option(parser)


def run(args: argparse.Namespace) -> int:
    """Print the summary of a log.

    Raises:
        FileError: The file cannot be read, is not a log, or has no such vehicle.
    """
    from darko_gcs.logs.log_report import summary_as_json, summary_as_text
    from protocol.flight_log.flight_summary import (
        chosen_vehicle,
        summarise,
    )
    from protocol.tlog import read_tlog

    reader, name = read_tlog(args.file), str(args.file)
    if args.vehicle is not None:
        chosen_vehicle(reader, name, args.vehicle)
    summary = summarise(reader, args.vehicle)
    print(summary_as_json(summary, name) if args.json else summary_as_text(summary, name, max(args.texts, 0)))
    return 0
