"""``darko-gcs log fetch``: list the vehicle's own logs and download them over the link."""

from __future__ import annotations

import argparse
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from darko_gcs.commands.options import add_listen_options

if TYPE_CHECKING:
    import asyncio

    from darko_gcs.tasks.log_download import DownloadedLogs

_EXAMPLES = """\
examples:
  darko-gcs log fetch                    the newest log, into this folder
  darko-gcs log fetch --list             list the logs only
  darko-gcs log fetch 0 3 --to flights   these two
  darko-gcs log fetch all                all of them

The vehicle records every flight from arming to disarming. Use darko-gcs log info to see what is in a log.
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log fetch``."""
    parser.epilog, parser.formatter_class = _EXAMPLES, argparse.RawDescriptionHelpFormatter
    parser.add_argument("which", nargs="*", default=["last"], metavar="LOG", help="numbers, last or all [last]")
    parser.add_argument("--list", action="store_true", help="list the vehicle's logs, download none")
    parser.add_argument("--to", type=Path, default=Path(), metavar="DIR", help="folder to write to [this folder]")
    parser.add_argument("--json", action="store_true", help="print the result, or the failure, as JSON")
    add_listen_options(parser.add_argument_group("link"))


def run(args: argparse.Namespace) -> int:
    """Download the logs and print their names.

    Raises:
        GroundError: If the link, the vehicle, a log or a file fails.
    """
    import asyncio

    from darko_gcs.tasks.log_download import download_logs

    downloaded = asyncio.run(download_logs(args))
    print(downloads_as_json(downloaded) if args.json else downloads_as_text(downloaded))
    return 0


def downloads_as_json(downloaded: DownloadedLogs) -> str:
    """The result for a program."""
    logs = [
        {"number": log.number, "began": log.time_utc or None, "bytes": log.size, "file": _file(downloaded, log.number)}
        for log in downloaded.logs
    ]
    return json.dumps({"ok": True, "logs": logs}, indent=1)


def downloads_as_text(downloaded: DownloadedLogs) -> str:
    """The result for a person."""
    if not downloaded.logs:
        return "the vehicle has no logs"
    if downloaded.files:
        return "\n".join(f"log {number} -> {path}" for number, path in downloaded.files.items())
    return "\n".join(f"log {log.number}: {log.size} bytes, {_start_text(log.time_utc)}" for log in downloaded.logs)


def _file(downloaded: DownloadedLogs, number: int) -> str | None:
    path = downloaded.files.get(number)
    return None if path is None else str(path)


def _start_text(time_utc: int) -> str:
    return f"{datetime.fromtimestamp(time_utc, UTC):%Y-%m-%d %H:%M:%S} UTC" if time_utc else "no date"
