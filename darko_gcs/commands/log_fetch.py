"""List the vehicle's own logs and download them over the link."""

from __future__ import annotations

import argparse
import asyncio
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from darko_gcs.commands.options import add_listen_options

if TYPE_CHECKING:
    from darko_gcs.log_transfer import Fetched

__all__ = ["configure", "run"]

EXAMPLES = """\
examples:
  darko-gcs log fetch                    the newest log, into this folder
  darko-gcs log fetch --list             what logs there are
  darko-gcs log fetch 0 3 --to flights   these two
  darko-gcs log fetch all                every one

The vehicle records every flight from arming to disarming; darko-gcs log info says what is in a log.
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log fetch``."""
    parser.epilog, parser.formatter_class = EXAMPLES, argparse.RawDescriptionHelpFormatter
    parser.add_argument("which", nargs="*", default=["last"], metavar="LOG", help="numbers, last or all [last]")
    parser.add_argument("--list", action="store_true", help="only say what logs there are")
    parser.add_argument("--to", type=Path, default=Path(), metavar="DIR", help="where they are written [this folder]")
    parser.add_argument("--json", action="store_true", help="print the result for a program")
    add_listen_options(parser.add_argument_group("link"))


def run(args: argparse.Namespace) -> int:
    """Fetch, and print what was fetched.

    Raises:
        GroundError: If the link, the vehicle, a log or a file fails.
    """
    from darko_gcs.log_transfer import fetch_logs  # noqa: PLC0415 - --help must not load the wire

    fetched = asyncio.run(fetch_logs(args))
    print(_as_json(fetched) if args.json else _as_text(fetched))
    return 0


def _as_json(fetched: Fetched) -> str:
    logs = [
        {"number": log.number, "began": log.time_utc or None, "bytes": log.size, "file": _file(fetched, log.number)}
        for log in fetched.logs
    ]
    return json.dumps({"logs": logs}, indent=1)


def _as_text(fetched: Fetched) -> str:
    if not fetched.logs:
        return "the vehicle has no logs"
    if fetched.files:
        return "\n".join(f"log {number} -> {path}" for number, path in fetched.files.items())
    return "\n".join(f"log {log.number}: {log.size} bytes, {_began(log.time_utc)}" for log in fetched.logs)


def _file(fetched: Fetched, number: int) -> str | None:
    path = fetched.files.get(number)
    return None if path is None else str(path)


def _began(time_utc: int) -> str:
    return f"{datetime.fromtimestamp(time_utc, UTC):%Y-%m-%d %H:%M:%S} UTC" if time_utc else "no date"
