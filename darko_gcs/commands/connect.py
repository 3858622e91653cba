"""``darko-gcs [connect]``: the ground station on a vehicle."""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import socket
import sys
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from darko_gcs.commands.options import (
    KNOWN_PARAMETERS,
    add_link_options,
    add_screen_options,
    checked_sitl_arguments,
    listening_port,
    overlay_of,
)
from darko_gcs.errors import GroundError
from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import port_number

if TYPE_CHECKING:
    from darko_gcs.feed.feed import Feed
    from protocol.tlog import TlogWriter

IN_BROWSER = "TEXTUAL_DRIVER"  # an environment variable that the page's own station is started with
WEB_PORT = 8000

_EXAMPLES = """\
examples:
  darko-gcs                       wait for a vehicle on 127.0.0.1:14550
  darko-gcs --sitl                also start a simulated vehicle, and stop it at the end
  darko-gcs --sitl --wind 4@270   with wind from the west
  darko-gcs --sitl --web          the same screens in a browser, on http://127.0.0.1:8000

In the screens ? shows every key, q quits.

other commands (darko-gcs COMMAND --help):
"""


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs [connect]``."""
    listing = "".join(f"  {name:<8}{text}\n" for name, text in commands.items() if name != "connect")
    parser = CommandParser(
        prog="darko-gcs",
        description="Ground station of DarkO in the terminal, over MAVLink 2 on UDP.",
        epilog=_EXAMPLES + listing,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="print the version and exit (without other options)")
    parser.add_argument(
        "--mission", type=Path, metavar="FILE", help="open this .plan or QGC WPL 110 file (press m to see it)"
    )
    parser.add_argument(
        "--web",
        type=port_number,
        nargs="?",
        const=WEB_PORT,
        metavar="PORT",
        help=f"show the screens in a browser on this machine, not in the terminal [port {WEB_PORT}]",
    )
    add_screen_options(parser)
    add_link_options(parser)
    return parser


def run(args: argparse.Namespace) -> int:
    """Open the screens, here or in a browser, until the operator quits; see :func:`open_screens`."""
    if args.web is not None and IN_BROWSER not in os.environ:
        return _serve_page(args)
    return open_screens(args)


def open_screens(args: argparse.Namespace) -> int:
    """Open the screens here until the operator quits.

    Raises:
        GroundError: If a file, a key, the link or the vehicle process fails.
    """
    from platformdirs import user_state_path

    from darko_gcs.feed.live_feed import LiveFeed
    from darko_gcs.preferences import PreferencesFile
    from darko_gcs.station.keyring_setup import open_keyring
    from darko_gcs.station.parameter_requests import KnownParameters
    from darko_gcs.station.recording import default_folder, start_recording
    from darko_gcs.station.station import Station
    from darko_gcs.tui.app import GroundStationApp, run_screens
    from darko_gcs.tui.plan_draft import PlanDraft, RecentFiles, short_path
    from protocol.errors import FileError, LocalProtocolError
    from protocol.plans import load
    from protocol.wire.other_dialects import OtherDialect

    try:
        draft = PlanDraft(recent=RecentFiles(user_state_path("darko") / "recent-plans"))
        if args.mission is not None:
            draft.take(load(args.mission), str(args.mission))
            draft.recent.add(args.mission)
    except FileError as error:
        raise GroundError(str(error)) from error
    try:
        other = OtherDialect(args.dialect or "all")
    except LocalProtocolError as error:
        raise GroundError(f"--dialect: {error}") from error
    on_alert, overlay = _alert_command(args.on_alert), overlay_of(args)
    sitl = checked_sitl_arguments(args) if args.sitl else None
    keyring = open_keyring(args.signing_key, give_key=args.give_key)
    live = "" if args.live_3d is None else f"http://127.0.0.1:{args.live_3d}/"
    recorder: TlogWriter | None
    path: Path | None
    try:
        recorder, path = start_recording(args.record or default_folder())
        greeting, fault = f"Recording {path.name} in {short_path(path.parent)}", ""
    except GroundError as error:  # the flight matters more than its log
        recorder, path, greeting, fault = None, None, "", str(error)
    greeting = ". ".join(filter(None, (greeting, f"Live 3-D page: {live}" if live else "")))
    station = Station(recorder, keyring, give_key=args.give_key, vehicle=args.vehicle, other=other, system=args.id)
    if fault:
        station.report_recording_fault(fault, time.monotonic())
    feed = LiveFeed(station, args.host, listening_port(args), sitl, greeting=greeting, api_port=args.api_port)
    app = GroundStationApp(feed, PreferencesFile(), on_alert)
    app.draft, app.overlay, app.live_page, app.recording = draft, overlay, live, str(path or "")
    with _live_page(feed, args.live_3d):
        code = run_screens(app)
    if station.parameter_metadata.file and station.snapshot.is_darko:
        KnownParameters(user_state_path("darko") / KNOWN_PARAMETERS).keep(station.parameter_metadata.file)
    if station.recording_fault:
        print(f"darko-gcs: {station.recording_fault}", file=sys.stderr)
    _tell_recording(path)
    return code


def _tell_recording(path: Path | None) -> None:
    """Say how the flight is seen again; nothing of one that was not kept, or in a browser."""
    if path is not None and path.exists() and IN_BROWSER not in os.environ:
        print(f"darko-gcs: recorded; to see it again: {shlex.join(['darko-gcs', 'replay', str(path)])}")


def _live_page(feed: Feed, port: int | None) -> AbstractContextManager[object]:
    """The page in 3-D; nothing without a port.

    Raises:
        GroundError: It is no port, or taken; in a browser, where the page was not asked for, there is none then.
    """
    if port is None:
        return nullcontext()
    if port == 0:
        raise GroundError("--live-3d 0: a page needs a port of its own")
    from darko_gcs.live_page import LivePage

    try:
        return LivePage(feed, port)
    except OSError as error:
        if IN_BROWSER in os.environ:
            return nullcontext()
        raise GroundError(f"--live-3d {port}: {error.strerror}") from error


def _alert_command(text: str | None) -> list[str]:
    """The words of the command of ``--on-alert``; none without one.

    Raises:
        GroundError: It is no command, or there is no such program.
    """
    if text is None:
        return []
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise GroundError(f"--on-alert {text}: {error}") from error
    if not words or shutil.which(words[0]) is None:
        raise GroundError(f"--on-alert {text}: there is no program {words[0] if words else ''}".rstrip())
    return words


def _serve_page(args: argparse.Namespace) -> int:
    """Serve the screens until Ctrl+C.

    Raises:
        GroundError: An option is refused, textual-serve is missing, or the port is taken.
    """
    try:
        from darko_gcs.web import PageServer
    except ImportError as error:
        raise GroundError(f"--web needs {error.name}: pip install 'darko[web]'") from error
    if args.web == 0:
        raise GroundError("--web 0: a page needs a port of its own")
    checked_sitl_arguments(args)
    live_port = args.live_3d or _free_port()
    command = shlex.join([sys.executable, "-m", "darko_gcs", *sys.argv[1:], "--live-3d", str(live_port)])
    try:
        PageServer(command, args.web, live_port).serve()
    except OSError as error:
        raise GroundError(f"--web {args.web}: {error.strerror}") from error
    return 0


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        return int(free.getsockname()[1])
