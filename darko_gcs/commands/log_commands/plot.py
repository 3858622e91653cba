"""``darko-gcs log plot``: quantities of a log over time, in the terminal or as a picture."""

from __future__ import annotations

import argparse
from pathlib import Path

from darko_gcs.commands.log_commands.result import tell, tell_vehicle, vehicle_table
from darko_gcs.commands.options import add_log_vehicle_option, add_span_options


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
    add_log_vehicle_option(parser)


def run(args: argparse.Namespace) -> int:
    """Plot.

    Raises:
        FileError: The log cannot be read, or a field is not in it.
        GroundError: The picture cannot be written.
    """
    from shutil import get_terminal_size

    from darko_gcs.logs.field_plot import save_picture, text_plot
    from darko_gcs.logs.log_selection import Span, selected
    from protocol.tlog import read_tlog

    reader, name = read_tlog(args.file), str(args.file)
    selection = selected(reader, name, args.fields, Span(args.begin, args.end), args.vehicle)
    if args.vehicle is None:
        tell_vehicle(reader, selection.source, name)
    told = {**vehicle_table(reader, selection.source), "plotted": selection.figures()}
    if args.out is not None:
        save_picture(selection, args.out, args.file.name)
        tell(args, str(args.out), file=str(args.out), **told)
    elif args.json:
        tell(args, "", **told)
    else:
        columns, lines = get_terminal_size()
        print(text_plot(selection, columns, max(min(lines - 2, 30), 10)))
    return 0
