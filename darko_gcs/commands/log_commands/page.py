"""``darko-gcs log report``: one HTML page about a recorded flight."""

from __future__ import annotations

import argparse
from pathlib import Path

__all__ = ["configure", "run"]


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log report``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="telemetry log (.tlog)")
    parser.add_argument("--out", type=Path, metavar="PAGE", help="the page to write [FILE with .html]")


def run(args: argparse.Namespace) -> int:
    """Write the page.

    Raises:
        FileError: The log cannot be read, has no vehicle, or the page cannot be written.
        MissingPlotlyError: Plotly is not installed.
    """
    # --help must be quick: the dialect and numpy are loaded only here.
    from protocol.flight_log.flight_page import flight_page, require_plotly  # noqa: PLC0415
    from protocol.flight_log.flight_series import flight_series  # noqa: PLC0415
    from protocol.tlog import read_tlog  # noqa: PLC0415
    from protocol.tools.atomic_write import write_atomically  # noqa: PLC0415

    require_plotly()
    page = args.out or args.file.with_suffix(".html")
    flight = flight_series(read_tlog(args.file), str(args.file))
    write_atomically(page, flight_page(flight, title=f"Flight {args.file.name}").encode())
    print(f"{page}: {flight.duration:.1f} s of flight, {len(flight.summary.jumps)} jumps")
    return 0
