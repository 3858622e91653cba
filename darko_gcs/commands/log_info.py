"""Say what is in a telemetry log: vehicles, flight, messages, damage."""

from __future__ import annotations

import argparse
from pathlib import Path

__all__ = ["configure", "run"]


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log info``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="telemetry log (.tlog)")
    parser.add_argument("--json", action="store_true", help="print everything, for a program")
    parser.add_argument("--texts", type=int, default=10, metavar="N", help="show the last N status texts (10)")


def run(args: argparse.Namespace) -> int:
    """Print what is in a log.

    Raises:
        FileError: The file cannot be read, or is no log.
    """
    # --help must stay quick: only here are the dialect and numpy needed.
    from darko_gcs.flight_summary import summarise  # noqa: PLC0415
    from darko_gcs.log_report import as_json, as_text  # noqa: PLC0415
    from protocol.tlog import read_tlog  # noqa: PLC0415

    summary, name = summarise(read_tlog(args.file)), str(args.file)
    print(as_json(summary, name) if args.json else as_text(summary, name, max(args.texts, 0)))
    return 0
