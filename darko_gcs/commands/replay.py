"""``darko-gcs replay``: recorded flights on the same screens."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from pathlib import Path

__all__ = ["parser", "run"]

MAX_PARTS = 3  # of a time: hours, minutes, seconds


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs replay``."""
    parser = argparse.ArgumentParser(
        prog="darko-gcs replay",
        description=commands["replay"] + ".",
        epilog="keys: space pauses, left/right seek 5 s, tab goes to the next mark, ? shows all of them",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="a .tlog of this or another ground station")
    parser.add_argument("--speed", type=_speed, default=1.0, metavar="X", help="initial playing speed [1]")
    parser.add_argument(
        "--at", type=_time, default=0.0, metavar="TIME", help="where to begin: seconds, M:SS or H:MM:SS [0]"
    )
    return parser


def _speed(text: str) -> float:
    value = _number(text)
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not a positive number")
    return value


def _time(text: str) -> float:
    """Seconds, as a number or as the clock on the screen shows them."""
    parts = text.split(":")
    if len(parts) > MAX_PARTS or not all(part.isdigit() for part in parts[:-1]):
        raise argparse.ArgumentTypeError(f"{text!r} is not a time: seconds, M:SS or H:MM:SS")
    total = sum(60.0**power * _number(part) for power, part in enumerate(reversed(parts)))
    if total < 0.0:
        raise argparse.ArgumentTypeError(f"{text} is before the beginning")
    return total


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number")
    return value


def run(args: argparse.Namespace) -> int:
    """Open the screens on a log until the operator quits.

    Raises:
        GroundError: The file cannot be read.
    """
    from darko_gcs.errors import GroundError  # noqa: PLC0415
    from darko_gcs.feed.replay_feed import ReplayFeed  # noqa: PLC0415
    from darko_gcs.preferences import PreferencesFile  # noqa: PLC0415
    from darko_gcs.tui.replay_app import ReplayApp  # noqa: PLC0415
    from protocol.errors import FileError  # noqa: PLC0415 - --help must not load the wire
    from protocol.tlog import read_tlog  # noqa: PLC0415

    try:
        feed = ReplayFeed(read_tlog(args.file), args.file.name, begin=args.at, speed=args.speed)
    except FileError as error:
        raise GroundError(str(error)) from error
    return ReplayApp(feed, PreferencesFile()).run() or 0
