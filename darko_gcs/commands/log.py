"""``darko-gcs log``: recorded flights, here and on the vehicle."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from darko_gcs.commands.options import add_listen_options, add_log_vehicle_option, add_span_options, clock_time
from protocol.tools.command_line import CommandParser, print_json
from protocol.tools.option_values import STATION_PORT, STATION_URL, positive_number, whole_number

if TYPE_CHECKING:
    from darko_gcs.feed.links import OutwardAddress
    from darko_gcs.logs.log_export import Span
    from darko_gcs.tasks.log_download import DownloadedLogs
    from darko_gcs.tasks.log_player import LogPlayer
    from protocol.flight_log.field_expressions import Curve
    from protocol.tlog import TlogReader
    from protocol.wire.message import Source


def tell(args: argparse.Namespace, words: str, **result: Any) -> None:  # noqa: ANN401 - anything that JSON has
    """Print a result.

    Args:
        args: Whose ``json`` says for whom.
        words: For a person.
        result: For a program, by name.
    """
    if args.json:
        print_json({"ok": True, **result})
    else:
        print(words)


def opened(path: Path) -> TlogReader:
    """The log in a file; damage that makes it end early is said on stderr."""
    from protocol.flight_log.flight_summary import damage_note
    from protocol.foreign_logs import read_log

    reader = read_log(path)
    if note := damage_note(reader):
        print(f"{path}: {note}", file=sys.stderr)
    return reader


def tell_vehicle(reader: TlogReader, source: Source, name: str) -> None:
    """Say on stderr which vehicle of several is taken."""
    from protocol.flight_log.flight_summary import others_note

    if note := others_note(reader, source):
        print(f"{name}: {note}", file=sys.stderr)


def tell_restarts(reader: TlogReader, source: Source, name: str, span: Span) -> None:
    """Say on stderr how times go on where the vehicle restarted, if a span of them is asked for."""
    from darko_gcs.state.text import format_time
    from protocol.flight_log.flight_clock import flight_clock

    if math.isinf(span.begin) and math.isinf(span.end):
        return
    for begun in flight_clock(reader, source).restarts:
        note = (
            f"the vehicle restarted: 0:00.0 of its clock since then is {format_time(float(begun))} of the log's times"
        )
        print(f"{name}: {note}", file=sys.stderr)


def vehicle_table(reader: TlogReader, source: Source) -> dict[str, Any]:
    """The vehicle that is taken, and the others of the log, for a program."""
    from protocol.flight_log.flight_summary import vehicles

    others = [other for other in vehicles(reader) if other != source]
    return {"vehicle": _ids(source), "other_vehicles": [_ids(other) for other in others]}


def _ids(source: Source) -> dict[str, int]:
    return {"system": source[0], "component": source[1]}


def configure_info(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log info``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a log: .tlog, ULog, DataFlash .bin, Paparazzi .log")
    parser.add_argument("--texts", type=whole_number, default=10, metavar="N", help="show the last N status texts [10]")
    add_log_vehicle_option(parser)


def run_info(args: argparse.Namespace) -> int:
    """Print the summary of a log.

    Raises:
        FileError: The file cannot be read, is not a log, or has no such vehicle.
    """
    from darko_gcs.logs.log_report import summary_as_json, summary_as_text
    from protocol.flight_log.flight_summary import chosen_vehicle, summarise

    reader, name = opened(args.file), str(args.file)
    if args.vehicle is not None:
        chosen_vehicle(reader, name, args.vehicle)
    summary = summarise(reader, args.vehicle)
    print(summary_as_json(summary, name) if args.json else summary_as_text(summary, name, max(args.texts, 0)))
    return 0


def configure_report(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log report``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a log: .tlog, ULog, DataFlash .bin, Paparazzi .log")
    parser.add_argument("--out", type=Path, metavar="PAGE", help="the page to write [FILE with .html]")
    parser.add_argument("--view", metavar="NAME", help="also draw these charts, as the screens keep them")
    add_log_vehicle_option(parser)


def run_report(args: argparse.Namespace) -> int:
    """Write the page.

    Raises:
        FileError: The log cannot be read, has no vehicle, or the page cannot be written.
        MissingPlotlyError: Plotly is not installed.
    """
    from protocol.flight_log.flight_page import flight_page, require_plotly
    from protocol.flight_log.flight_series import flight_series
    from protocol.flight_log.flight_summary import vehicles
    from protocol.tools.files import write_atomically

    require_plotly()
    page = args.out or args.file.with_suffix(".html")
    reader, name = opened(args.file), str(args.file)
    flight = flight_series(reader, name, args.vehicle)
    source = flight.summary.system, flight.summary.component
    told, several = vehicle_table(reader, source), len(vehicles(reader)) > 1
    views = [] if args.view is None else [_view_charts(reader, args.view, source)]
    title = f"Flight {args.file.name}" + (f", vehicle {source[0]}/{source[1]}" if several else "")
    write_atomically(page, flight_page(flight, title=title, views=views).encode())
    if args.vehicle is None:
        tell_vehicle(reader, source, name)
    jumps = len(flight.summary.jumps)
    words = f"{page}: {flight.duration:.1f} s recorded, {jumps} jumps"
    tell(args, words, file=str(page), **told, duration=flight.duration, jumps=jumps)
    return 0


def configure_plot(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log plot``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a log: .tlog, ULog, DataFlash .bin, Paparazzi .log")
    parser.add_argument(
        "fields",
        nargs="*",
        metavar="FIELD",
        help="what to plot: LOCAL_POSITION_NED.z, deg(ATTITUDE.roll), DARKO_ACTUATORS.elevon[0] (docs/logs.md)",
    )
    parser.add_argument("--view", metavar="NAME", help="the charts of a view, as the screens keep them")
    parser.add_argument("--out", type=Path, metavar="PICTURE", help=".png, .svg or .pdf instead of the terminal")
    add_span_options(parser)
    add_log_vehicle_option(parser)


def run_plot(args: argparse.Namespace) -> int:
    """Plot.

    Raises:
        FileError: The log cannot be read, or a field is not in it.
        GroundError: The picture cannot be written.
    """
    from shutil import get_terminal_size

    from darko_gcs.errors import GroundError
    from darko_gcs.logs.log_export import Span, save_picture, selected, text_plot
    from protocol.flight_log.flight_summary import chosen_vehicle

    if bool(args.fields) is (args.view is not None):
        raise GroundError("name the fields to plot, or a --view")
    reader, name = opened(args.file), str(args.file)
    source, span = chosen_vehicle(reader, name, args.vehicle), Span(args.begin, args.end)
    charts = [args.fields] if args.view is None else _known_charts(reader, args.view, source)
    selections = [selected(reader, name, chart, span, args.vehicle) for chart in charts]
    tell_restarts(reader, source, name, span)
    if args.vehicle is None:
        tell_vehicle(reader, source, name)
    figures = [figure for selection in selections for figure in selection.figures()]
    told = {**vehicle_table(reader, source), "plotted": figures}
    if args.out is not None:
        save_picture(selections, args.out, args.file.name)
        tell(args, str(args.out), file=str(args.out), **told)
    elif args.json:
        tell(args, "", **told)
    else:
        columns, lines = get_terminal_size()
        parts = [part for selection in selections for part in selection.by_unit()]
        for part in parts:
            print(text_plot(part, columns, max(min(lines - 2, 30) // len(parts), 10)))
    return 0


def _known_charts(reader: TlogReader, view: str, source: Source) -> list[tuple[str, ...]]:
    """The charts of a view, with what the vehicle sent; the rest is said on stderr.

    Raises:
        FileError: There is no such view, or the log has nothing of it.
    """
    from darko_gcs.state.chart_views import ChartViews
    from protocol.errors import FileError
    from protocol.flight_log.field_expressions import quantity

    charts, lacking = [], []
    for chart in ChartViews().view(view).charts:
        known = []
        for text in chart:
            try:
                quantity(reader, text, source)
            except FileError as error:
                lacking.append(str(error))
            else:
                known.append(text)
        charts += [tuple(known)] if known else []
    if not charts:
        raise FileError(f"view {view}: {'; '.join(lacking)}")
    for reason in lacking:
        print(f"view {view}: left out: {reason}", file=sys.stderr)
    return charts


def _view_charts(reader: TlogReader, view: str, source: Source) -> tuple[str, list[list[Curve]]]:
    """A view's name, and the curves of its charts.

    Raises:
        FileError: There is no such view, or the log has nothing of it.
    """
    from protocol.flight_log.field_expressions import LoggedFields, curve
    from protocol.flight_log.flight_clock import times_in_log

    table = LoggedFields(reader, source, times_in_log(reader, source))
    return view, [[curve(table, text) for text in chart] for chart in _known_charts(reader, view, source)]


TABLES, PATHS, MESSAGES = (".csv", ".parquet"), (".kml",), (".mcap",)


def configure_export(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log export``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a log: .tlog, ULog, DataFlash .bin, Paparazzi .log")
    parser.add_argument("out", type=Path, metavar="OUT", help=".csv, .parquet, .kml or .mcap")
    parser.add_argument(
        "fields",
        nargs="*",
        metavar="FIELD",
        help="columns of a table, as of 'log plot', its rows at the times of the first field's message (others "
        "there in proportion, angles on the circle, codes as told last); or messages of an .mcap by name [all]",
    )
    add_span_options(parser)
    add_log_vehicle_option(parser)


def run_export(args: argparse.Namespace) -> int:
    """Write the file.

    Raises:
        FileError: The log cannot be read, a field is not in it, or the file cannot be written.
        GroundError: The format is not known or its package is not installed.
    """
    from darko_gcs.errors import GroundError
    from darko_gcs.logs import log_export
    from darko_gcs.logs.log_export import Span, selected
    from protocol.flight_log.flight_summary import chosen_vehicle
    from protocol.tools.files import write_atomically

    kind, name, span = args.out.suffix, str(args.file), Span(args.begin, args.end)
    if kind not in {*TABLES, *PATHS, *MESSAGES}:
        raise GroundError(f"{args.out}: the name must end in {', '.join((*TABLES, *PATHS, *MESSAGES))}")
    if kind in TABLES and not args.fields:
        raise GroundError(f"{args.out}: a table needs the fields that are its columns, such as ATTITUDE.roll")
    if kind in PATHS and args.fields:
        raise GroundError(f"{args.out}: a path has no fields")
    reader = opened(args.file)
    source = chosen_vehicle(reader, name, args.vehicle)
    told: dict[str, Any] = {"file": str(args.out), **vehicle_table(reader, source)}
    if kind in TABLES:
        selection = selected(reader, name, args.fields, span, args.vehicle, is_table=True)
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
    tell_restarts(reader, source, name, span)
    if args.vehicle is None and kind not in MESSAGES:
        tell_vehicle(reader, source, name)
    tell(args, f"{args.out}: {len(data)} bytes", **told, bytes=len(data))
    return 0


PAUSE = 0.1  # before it begins anew [s]


def configure_play(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log play``."""
    parser.epilog = (
        f"QGroundControl and darko-gcs listen on {STATION_PORT}. Frames are sent byte for byte at their times. "
        "Not sent: signed frames, those of ground stations, damage."
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="a log: .tlog, ULog, DataFlash .bin, Paparazzi .log")
    parser.add_argument(
        "--to",
        default=STATION_URL,
        metavar="URL",
        help=f"where the station listens, udpout:HOST:PORT [{STATION_URL}]",
    )
    parser.add_argument("--network", action="store_true", help="allow an address of another machine")
    parser.add_argument("--speed", type=positive_number, default=1.0, metavar="X", help="playing speed [1]")
    parser.add_argument(
        "--at",
        type=clock_time,
        default=0.0,
        metavar="TIME",
        help="where to begin: seconds, M:SS or H:MM:SS, as 'log info' tells them [0]",
    )
    parser.add_argument("--loop", action="store_true", help="begin anew at the end, until Ctrl+C")
    add_log_vehicle_option(parser)


def run_play(args: argparse.Namespace) -> int:
    """Play the log.

    Raises:
        FileError: The log cannot be read, or has no such vehicle.
        GroundError: There is nothing to send, or no way to the address.
    """
    import asyncio

    from darko_gcs.errors import GroundError
    from darko_gcs.tasks.log_player import LogPlayer, loopback_or_asked
    from protocol.flight_log.flight_summary import log_clock

    address = loopback_or_asked(args.to, is_network_allowed=args.network)
    reader, name = opened(args.file), str(args.file)
    clock = log_clock(reader, name, args.vehicle)
    player = LogPlayer(reader, speed=args.speed, vehicle=args.vehicle)
    if not len(player.frames.rows):
        raise GroundError(f"{args.file}: nothing to send: {player.frames.words}")
    begin = clock.playing_at(args.at)
    if begin >= player.frames.duration > 0.0:
        raise GroundError(f"--at {args.at:g}: the log ends after {clock.arrivals[-1]:.1f} s")
    begins = f"{args.file} to {address.words}: {player.frames.words}"
    print(begins, file=sys.stderr if args.json else sys.stdout, flush=True)
    try:
        asyncio.run(_play(player, address, begin, is_looping=args.loop))
    except KeyboardInterrupt:
        print(file=sys.stderr if args.json else sys.stdout)
    nobody = "; at times no program listened there" if player.refused else ""
    tell(
        args,
        f"{player.sent} frames sent{nobody}; {player.answers} datagrams came back, none answered",
        file=name,
        to=args.to,
        frames=len(player.frames.rows),
        duration=player.frames.duration,
        left_out=player.frames.left_out,
        sent=player.sent,
        answers=player.answers,
        heard=not player.refused,
    )
    return 0


async def _play(player: LogPlayer, address: OutwardAddress, begin: float, *, is_looping: bool) -> None:
    import asyncio

    await player.open(address)
    try:
        await player.play(begin)
        while is_looping:
            await asyncio.sleep(PAUSE)
            await player.play()
    finally:
        player.close()


_EXAMPLES = """\
examples:
  darko-gcs log fetch                    the newest log, into this folder
  darko-gcs log fetch --list             list the logs only
  darko-gcs log fetch 0 3 --to flights   these two
  darko-gcs log fetch all                all of them

The vehicle records every flight from arming to disarming. Use darko-gcs log info to see what is in a log.
"""


def configure_fetch(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log fetch``."""
    parser.epilog, parser.formatter_class = _EXAMPLES, argparse.RawDescriptionHelpFormatter
    parser.add_argument("which", nargs="*", default=["last"], metavar="LOG", help="numbers, last or all [last]")
    parser.add_argument("--list", action="store_true", help="list the vehicle's logs, download none")
    parser.add_argument("--to", type=Path, default=Path(), metavar="DIR", help="folder to write to [this folder]")
    parser.add_argument("--json", action="store_true", help="print the result, or the failure, as JSON")
    add_listen_options(parser.add_argument_group("link"))


def run_fetch(args: argparse.Namespace) -> int:
    """Download the logs and print their names.

    Raises:
        GroundError: If the link, the vehicle, a log or a file fails.
    """
    import asyncio

    from darko_gcs.tasks.log_download import download_logs

    downloaded = asyncio.run(download_logs(args))
    print(downloads_as_json(downloaded) if args.json else downloads_as_text(downloaded))
    return 0


def downloads_as_json(downloaded: DownloadedLogs) -> str:
    """The result for a program."""
    logs = [
        {"number": log.number, "began": log.time_utc or None, "bytes": log.size, "file": _file(downloaded, log.number)}
        for log in downloaded.logs
    ]
    return json.dumps({"ok": True, "logs": logs}, indent=1)


def downloads_as_text(downloaded: DownloadedLogs) -> str:
    """The result for a person."""
    if not downloaded.logs:
        return "the vehicle has no logs"
    if downloaded.files:
        return "\n".join(f"log {number} -> {path}" for number, path in downloaded.files.items())
    return "\n".join(f"log {log.number}: {log.size} bytes, {_start_text(log.time_utc)}" for log in downloaded.logs)


def _file(downloaded: DownloadedLogs, number: int) -> str | None:
    path = downloaded.files.get(number)
    return None if path is None else str(path)


def _start_text(time_utc: int) -> str:
    return f"{datetime.fromtimestamp(time_utc, UTC):%Y-%m-%d %H:%M:%S} UTC" if time_utc else "no date"


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs log``."""
    parser = CommandParser(prog="darko-gcs log", description=commands["log"] + ".")
    subcommands = parser.add_subparsers(dest="subcommand", required=True, metavar="info|report|plot|export|play|fetch")
    for name, configure, run_it, text in (
        ("info", configure_info, run_info, "summarise one log: vehicles, flight, messages, damage"),
        (
            "report",
            configure_report,
            run_report,
            "write a page about a flight: path, V and jumps, actuators, energy, errors, events",
        ),
        ("plot", configure_plot, run_plot, "plot quantities of a log, in the terminal or as a picture"),
        ("export", configure_export, run_export, "write a log as CSV, Parquet, KML or MCAP"),
        ("play", configure_play, run_play, "send a log to another ground station, as if the vehicle flew now"),
        ("fetch", configure_fetch, run_fetch, "download the logs that a vehicle has recorded itself"),
    ):
        subcommand = subcommands.add_parser(name, help=text)
        configure(subcommand)
        subcommand.set_defaults(run=run_it)
    return parser


def run(args: argparse.Namespace) -> int:
    """Run the subcommand.

    Raises:
        GroundError: If it fails.
    """
    from darko_gcs.errors import GroundError
    from protocol.errors import ProtocolError

    try:
        return int(args.run(args))
    except ProtocolError as error:
        raise GroundError(str(error)) from error
