"""``darko-gcs log export``: a log for other programs."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from darko_gcs.commands.log_commands.result import tell, tell_vehicle, vehicle_table
from darko_gcs.commands.options import add_log_vehicle_option, add_span_options

TABLES, PATHS, MESSAGES = (".csv", ".parquet"), (".kml",), (".mcap",)


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log export``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="telemetry log (.tlog)")
    parser.add_argument("out", type=Path, metavar="OUT", help=".csv, .parquet, .kml or .mcap")
    parser.add_argument(
        "fields",
        nargs="*",
        metavar="FIELD",
        help="columns of a table, as of 'log plot'; or messages of an .mcap by name [all]",
    )
    add_span_options(parser)
    add_log_vehicle_option(parser)


def run(args: argparse.Namespace) -> int:
    """Write the file.

    Raises:
        FileError: The log cannot be read, a field is not in it, or the file cannot be written.
        GroundError: The format is not known or its package is not installed.
    """
    from darko_gcs.errors import GroundError
    from darko_gcs.logs import log_export
    from darko_gcs.logs.log_selection import Span, selected
    from protocol.flight_log.flight_summary import chosen_vehicle
    from protocol.tlog import read_tlog
    from protocol.tools.files import write_atomically

    kind, name, span = args.out.suffix, str(args.file), Span(args.begin, args.end)
    if kind not in {*TABLES, *PATHS, *MESSAGES}:
        raise GroundError(f"{args.out}: the name must end in {', '.join((*TABLES, *PATHS, *MESSAGES))}")
    if kind in TABLES and not args.fields:
        raise GroundError(f"{args.out}: a table needs the fields that are its columns, such as ATTITUDE.roll")
    if kind in PATHS and args.fields:
        raise GroundError(f"{args.out}: a path has no fields")
    reader = read_tlog(args.file)
    source = chosen_vehicle(reader, name, args.vehicle)
    told: dict[str, Any] = {"file": str(args.out), **vehicle_table(reader, source)}
    if kind in TABLES:
        selection = selected(reader, name, args.fields, span, args.vehicle)
        data = log_export.as_csv(selection) if kind == ".csv" else log_export.as_parquet(selection)
        told |= {"columns": ["time", *selection.names], "rows": len(selection.times[0])}
    elif kind in PATHS:
        data = log_export.as_kml(reader, name, source, span)
    else:
        data = log_export.as_mcap(reader, name, source, args.fields, span, alone=args.vehicle is not None)
        if unknown := int((~reader.known).sum()):
            told["left_out"] = [f"{unknown} messages that no dialect has"]
            print(f"{name}: left out: {told['left_out'][0]}", file=sys.stderr)
    write_atomically(args.out, data)
    if args.vehicle is None and kind not in MESSAGES:
        tell_vehicle(reader, source, name)
    tell(args, f"{args.out}: {len(data)} bytes", **told, bytes=len(data))
    return 0
