"""``darko-gcs replay``: recorded flights on the same screens."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from darko_gcs.commands.options import KNOWN_PARAMETERS, add_overlay_option, clock_time, overlay_of
from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import STATION_URL, finite_number, positive_number, system_id


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs replay``."""
    parser = CommandParser(
        prog="darko-gcs replay",
        description=commands["replay"] + ".",
        epilog="keys: space pauses, left/right seek 5 s, tab goes to the next mark, ? shows all of them",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="a log: .tlog, ULog, DataFlash .bin, Paparazzi .log")
    parser.add_argument("other", type=Path, nargs="?", metavar="OTHER", help="a second one, beside the first")
    parser.add_argument("--speed", type=positive_number, default=1.0, metavar="X", help="initial playing speed [1]")
    parser.add_argument(
        "--at",
        type=clock_time,
        metavar="TIME",
        help="where to begin: seconds, M:SS or H:MM:SS, as 'darko-gcs log info' tells them [0; of two flights: where "
        "the later recording begins]",
    )
    parser.add_argument(
        "--to",
        metavar="URL",
        help=f"where key u sends the replayed frames, udpout:HOST:PORT [{STATION_URL}]",
    )
    parser.add_argument("--network", action="store_true", help="allow an address of another machine")
    parser.add_argument(
        "--vehicle", type=system_id, metavar="ID", help="of several vehicles in a log, the one with this system id"
    )
    add_overlay_option(parser)
    pair = parser.add_argument_group("two flights")
    pair.add_argument(
        "--align",
        choices=("takeoff", "start", "clock"),
        help="what the two flights are aligned by: take-off (on the vehicles' clocks), the beginnings, the date "
        "[takeoff]",
    )
    pair.add_argument("--offset", type=finite_number, metavar="S", help="the second flight is S seconds later [0]")
    return parser


def run(args: argparse.Namespace) -> int:
    """Open the screens on a log until the operator quits.

    Raises:
        GroundError: The file cannot be read.
    """
    from platformdirs import user_state_path

    from darko_gcs.errors import GroundError
    from darko_gcs.feed.pair_feed import Alignment, PairFeed
    from darko_gcs.feed.replay_feed import ReplayFeed
    from darko_gcs.preferences import PreferencesFile
    from darko_gcs.station.parameter_requests import KnownParameters
    from darko_gcs.tasks.log_player import loopback_or_asked
    from darko_gcs.tui.app import run_screens
    from darko_gcs.tui.replay_app import PairApp, ReplayApp
    from protocol.errors import FileError
    from protocol.flight_log.flight_summary import of_vehicle
    from protocol.foreign_logs import read_log

    if args.other is None and (args.align is not None or args.offset is not None):
        raise GroundError("--align and --offset need a second log")
    if args.other is not None and args.to is not None:
        raise GroundError("--to works with one log only")
    send_to = loopback_or_asked(args.to or STATION_URL, is_network_allowed=args.network)
    overlay = overlay_of(args)
    known = KnownParameters(user_state_path("darko") / KNOWN_PARAMETERS).load()
    options: dict[str, Any] = {"begin": args.at or 0.0, "speed": args.speed, "send_to": send_to, "parameters": known}
    try:
        files = [path for path in (args.file, args.other) if path is not None]
        readers = [read_log(path) for path in files]
        if args.vehicle is not None:
            readers = [of_vehicle(reader, str(path), args.vehicle) for reader, path in zip(readers, files, strict=True)]
        feeds = [ReplayFeed(reader, path.name, **options) for reader, path in zip(readers, files, strict=True)]
    except FileError as error:
        raise GroundError(str(error)) from error
    if args.other is None:
        app = ReplayApp(feeds[0], PreferencesFile())
        app.overlay, app.recording = overlay, str(args.file)
        return run_screens(app)
    alignment = Alignment(args.align or Alignment.TAKE_OFF.value)
    pair = PairFeed(*feeds, alignment=alignment, shift=args.offset or 0.0, begin=args.at, speed=args.speed)
    both = PairApp(pair)
    both.overlay = overlay
    return run_screens(both)
