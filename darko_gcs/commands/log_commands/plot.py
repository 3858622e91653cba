"""``darko-gcs log plot``: quantities of a log over time, in the terminal or as a picture."""

from __future__ import annotations

import argparse
from pathlib import Path

from darko_gcs.commands.options import add_span_options

__all__ = ["configure", "run"]


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log plot``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="telemetry log (.tlog)")
    parser.add_argument(
        "fields",
        nargs="+",
        metavar="FIELD",
        help="what to plot: LOCAL_POSITION_NED.z, deg(ATTITUDE.roll), DARKO_ACTUATORS.elevon[0] (docs/logs.md)",
    )
    parser.add_argument("--out", type=Path, metavar="PICTURE", help=".png, .svg or .pdf instead of the terminal")
    add_span_options(parser)


def run(args: argparse.Namespace) -> int:
    """Plot.

    Raises:
        FileError: The log cannot be read, or a field is not in it.
        GroundError: The picture cannot be written.
    """
    from shutil import get_terminal_size  # noqa: PLC0415 - --help must be quick: so all of these

    from darko_gcs.logs.field_plot import save_picture, text_plot  # noqa: PLC0415
    from darko_gcs.logs.log_selection import Span, selected  # noqa: PLC0415
    from protocol.tlog import read_tlog  # noqa: PLC0415

    selection = selected(read_tlog(args.file), str(args.file), args.fields, Span(args.begin, args.end))
    if args.out is None:
        columns, lines = get_terminal_size()
        print(text_plot(selection, columns, max(min(lines - 2, 30), 10)))
    else:
        save_picture(selection, args.out, args.file.name)
        print(args.out)
    return 0
