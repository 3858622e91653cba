"""A day under the net, from one file."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import whole_number


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl day``."""
    options = CommandParser(
        prog="darko-sitl day",
        description=commands["day"] + ".",
        epilog="The same day live, for a ground station: darko-sitl --day FILE. Exit codes: 0 flown as written; "
        "1 crashed, or a request was refused; 2 a file or an argument.",
    )
    options.add_argument("file", type=Path, metavar="FILE", help="the day, a TOML file (docs/day.md)")
    options.add_argument("--seed", type=whole_number, metavar="N", help="another seed [the file's]")
    options.add_argument("--out", type=Path, metavar="PAGE", help="the page to write [NAME.html in this folder]")
    options.add_argument("--log", type=Path, metavar="FILE", help="also keep the flight's telemetry log (.tlog)")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly the day and write its page; exit code 1 if it crashed or refused a request.

    Raises:
        SitlError: A file cannot be used or written.
    """
    from tempfile import TemporaryDirectory  # noqa: PLC0415 - --help must not load the compiler

    from protocol.errors import ProtocolError  # noqa: PLC0415
    from protocol.flight_log.flight_page import require_plotly  # noqa: PLC0415
    from protocol.tools.files import write_atomically  # noqa: PLC0415
    from sitl.day import (  # noqa: PLC0415
        day_page,
        fly_day,
        load_day,
    )
    from sitl.errors import SitlError  # noqa: PLC0415

    day = load_day(args.file)
    if args.seed is not None:
        day = day._replace(seed=args.seed)
    page = args.out or Path(args.file.stem + ".html")
    try:
        require_plotly()
        with TemporaryDirectory() as folder:
            flown = fly_day(day, Path(folder))
            write_atomically(page, day_page(flown).encode())
            if args.log is not None:
                write_atomically(args.log, flown.log.read_bytes())
    except ProtocolError as error:
        raise SitlError(str(error)) from error
    for event in flown.aircraft.happened:
        print(f"{event.time:8.2f} s  {event.text}")
    print(
        f"{flown.verdict}: {flown.seconds:.1f} s in {flown.took:.1f} s, {flown.seconds / flown.took:.0f}x; page {page}"
    )
    return int(flown.aircraft.vehicle.crash is not None or bool(flown.refused))
