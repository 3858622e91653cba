"""``darko-gcs log report``: one HTML page about a recorded flight."""

from __future__ import annotations

import argparse
from pathlib import Path

from darko_gcs.commands.log_commands.result import tell, tell_vehicle, vehicle_table
from darko_gcs.commands.options import add_log_vehicle_option


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log report``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="telemetry log (.tlog)")
    parser.add_argument("--out", type=Path, metavar="PAGE", help="the page to write [FILE with .html]")
    add_log_vehicle_option(parser)


def run(args: argparse.Namespace) -> int:
    """Write the page.

    Raises:
        FileError: The log cannot be read, has no vehicle, or the page cannot be written.
        MissingPlotlyError: Plotly is not installed.
    """
    from protocol.flight_log.flight_page import flight_page, require_plotly
    from protocol.flight_log.flight_series import flight_series
    from protocol.flight_log.flight_summary import vehicles
    from protocol.tlog import read_tlog
    from protocol.tools.files import write_atomically

    require_plotly()
    page = args.out or args.file.with_suffix(".html")
    reader, name = read_tlog(args.file), str(args.file)
    flight = flight_series(reader, name, args.vehicle)
    source = flight.summary.system, flight.summary.component
    told, several = vehicle_table(reader, source), len(vehicles(reader)) > 1
    title = f"Flight {args.file.name}" + (f", vehicle {source[0]}/{source[1]}" if several else "")
    write_atomically(page, flight_page(flight, title=title).encode())
    if args.vehicle is None:
        tell_vehicle(reader, source, name)
    jumps = len(flight.summary.jumps)
    words = f"{page}: {flight.duration:.1f} s of flight, {jumps} jumps"
    tell(args, words, file=str(page), **told, duration=flight.duration, jumps=jumps)
    return 0
