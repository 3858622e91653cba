"""``darko-gcs replay``: recorded flights on the same screens."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from darko_gcs.commands.options import playing_speed, playing_time

__all__ = ["parser", "run"]


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs replay``."""
    parser = argparse.ArgumentParser(
        prog="darko-gcs replay",
        description=commands["replay"] + ".",
        epilog="keys: space pauses, left/right seek 5 s, tab goes to the next mark, ? shows all of them",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="a .tlog of this or another ground station")
    parser.add_argument("--speed", type=playing_speed, default=1.0, metavar="X", help="initial playing speed [1]")
    parser.add_argument(
        "--at", type=playing_time, default=0.0, metavar="TIME", help="where to begin: seconds, M:SS or H:MM:SS [0]"
    )
    return parser


def run(args: argparse.Namespace) -> int:
    """Open the screens on a log until the operator quits.

    Raises:
        GroundError: The file cannot be read.
    """
    from darko_gcs.errors import GroundError  # noqa: PLC0415
    from darko_gcs.feed.replay_feed import ReplayFeed  # noqa: PLC0415
    from darko_gcs.tui.replay_app import ReplayApp  # noqa: PLC0415
    from protocol.errors import FileError  # noqa: PLC0415 - --help must not load the wire
    from protocol.tlog import read_tlog  # noqa: PLC0415

    try:
        feed = ReplayFeed(read_tlog(args.file), args.file.name, begin=args.at, speed=args.speed)
    except FileError as error:
        raise GroundError(str(error)) from error
    return ReplayApp(feed).run() or 0
