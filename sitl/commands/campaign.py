"""``darko-sitl campaign``: any number of flights that a file draws."""

from __future__ import annotations

import argparse
import math
import shlex
import sys
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from protocol.errors import ProtocolError
from protocol.tools.command_line import command_parser
from protocol.tools.option_values import whole_number
from sitl.errors import SitlError

if TYPE_CHECKING:
    from sitl.lab.campaigns.engines import Engine
    from sitl.lab.campaigns.specification import Specification

CAMPAIGN_EXAMPLES = """examples:
  darko-sitl campaign                     the campaigns that are shipped
  darko-sitl campaign holds               fly one; after Ctrl+C, a crash or a full disk the same command goes on
  darko-sitl campaign mine.toml --cases 100000
  darko-sitl campaign square --set vehicle.controller=report --set vehicle.navigation=truth
  darko-sitl campaign holds --case 17     fly one case again, with its log and a page about it
  darko-sitl campaign holds --chunk 3     fly one chunk: a job of a batch system's array
  darko-sitl campaign holds --scheduler tcp://10.0.0.1:8786

Exit codes: 0 flown, and what the file requires holds; 1 it does not; 2 a file or an argument; 130 interrupted.
Files and results: docs/campaigns.md."""


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl campaign``."""
    options = command_parser("darko-sitl campaign", commands, CAMPAIGN_EXAMPLES)
    options.add_argument("file", nargs="?", metavar="NAME|FILE", help="a shipped campaign, or a TOML file")
    options.add_argument("--out", type=Path, metavar="DIR", help="folder of the results [NAME.campaign]")
    options.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="such as vehicle.controller=indi, or vary.wind.grid=[3]",
    )
    options.add_argument("--cases", type=whole_number, metavar="N", help="so many cases [the file's]")
    options.add_argument("--jobs", type=whole_number, metavar="N", help="processes at once [one for each core]")
    options.add_argument("--scheduler", metavar="ADDRESS", help="have the workers of this Dask scheduler fly")
    options.add_argument("--chunk", type=whole_number, metavar="K", help="fly chunk K alone, from 0 on")
    options.add_argument("--case", type=whole_number, metavar="N", help="fly case N again: log and page")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly the campaign, one of its chunks, or one case."""
    from sitl.lab.campaigns.specification import load_specification  # noqa: PLC0415 - --help loads no compiler

    if args.file is None:
        return _list()
    _check(args)
    specification = load_specification(args.file, _changes(args))
    folder = args.out or Path(f"{specification.name}.campaign")
    if args.case is not None:
        return fly_again(specification, args.case, folder)
    if args.chunk is not None:
        return _fly_one_chunk(specification, args.chunk, folder)
    return _fly_all(specification, folder, _engine(args), _command(args))


def _command(args: argparse.Namespace) -> str:
    """The command that was given, to fly one of its cases again."""
    return shlex.join(["darko-sitl", "campaign", args.file, *(word for given in args.set for word in ("--set", given))])


def _changes(args: argparse.Namespace) -> dict[str, Any]:
    """Values in place of the file's: those of TOML, or words."""
    changes: dict[str, Any] = {} if args.cases is None else {"run.cases": args.cases}
    for given in args.set:
        key, equals, text = given.partition("=")
        if not (key and equals):
            raise SitlError(f"--set {given}: must be KEY=VALUE, such as vehicle.controller=indi")
        try:
            changes[key] = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            changes[key] = str(Path(text).resolve()) if text.endswith(".toml") else text  # from here, not from the file
    return changes


def _list() -> int:
    from sitl.lab.campaigns.specification import load_specification, shipped_campaigns  # noqa: PLC0415

    for name in shipped_campaigns():
        print(f"{name:<16}{load_specification(name).about}")
    return 0


def _check(args: argparse.Namespace) -> None:
    one_of = [name for name in ("case", "chunk", "scheduler") if getattr(args, name) is not None]
    if len(one_of) > 1:
        raise SitlError(f"--{one_of[0]} and --{one_of[1]} do not go together")
    if args.jobs is not None and args.jobs < 1:
        raise SitlError(f"--jobs {args.jobs}: there must be at least 1")


def _engine(args: argparse.Namespace) -> Engine:
    from sitl.lab.campaigns import engines  # noqa: PLC0415
    from sitl.lab.campaigns.campaign_run import print_line  # noqa: PLC0415

    if args.scheduler is not None:
        engines.require_distributed()
        return engines.on_cluster(args.scheduler, print_line)
    jobs = args.jobs or engines.cores()
    return engines.fly_here if jobs == 1 else engines.on_processes(jobs)


def _fly_all(specification: Specification, folder: Path, engine: Engine, command: str) -> int:
    from sitl.lab.campaigns.campaign_page import campaign_page  # noqa: PLC0415
    from sitl.lab.campaigns.campaign_run import run_specification  # noqa: PLC0415
    from sitl.lab.campaigns.campaign_summary import parquet_table, passed, quantities, summary_lines  # noqa: PLC0415
    from sitl.lab.campaigns.chunks import ChunkStore, write_durably  # noqa: PLC0415

    try:
        result = run_specification(specification, ChunkStore(folder, specification), engine)
    except KeyboardInterrupt:
        print(f"\nstopped; what is flown is in {folder}, and the same command goes on", file=sys.stderr)
        raise
    drawn = quantities(specification, (one.number for one in result.flown))
    lines = summary_lines(result, drawn, command)
    write_durably(folder / "summary.txt", ("\n".join(lines) + "\n").encode())
    print("\n".join(lines), flush=True)
    _write_others(
        folder,
        lambda: parquet_table(result, drawn),
        lambda: campaign_page(result, drawn, lines, command).encode(),
    )
    return 0 if passed(result, drawn) else 1


def _write_others(folder: Path, table: Callable[[], bytes], page: Callable[[], bytes]) -> None:
    """Write table and page, each if what it needs is installed."""
    from sitl.lab.campaigns.campaign_summary import require_parquet  # noqa: PLC0415
    from sitl.lab.campaigns.chunks import write_durably  # noqa: PLC0415
    from sitl.tools.plotting import require_matplotlib  # noqa: PLC0415

    steps: list[tuple[str, Callable[[], None], Callable[[], bytes]]] = [
        ("cases.parquet", require_parquet, table),
        ("page.html", require_matplotlib, page),
    ]
    for name, required, made in steps:
        try:
            required()
        except SitlError as missing:
            print(f"no {name}: {missing}", file=sys.stderr)
            continue
        write_durably(folder / name, made())
        print(f"written: {folder / name}")


def _fly_one_chunk(specification: Specification, number: int, folder: Path) -> int:
    from sitl.lab.campaigns.chunks import ChunkStore, fly_chunk  # noqa: PLC0415

    chunks = specification.chunks
    if number >= len(chunks):
        raise SitlError(f"--chunk {number}: the campaign has the chunks 0 to {len(chunks) - 1}")
    store, cases = ChunkStore(folder, specification), chunks[number]
    if store.read(cases) is None:
        store.write(cases, fly_chunk(specification, cases))
    print(f"cases {cases.start} to {cases.stop - 1}: {store.path(cases)}")
    return 0


def fly_again(specification: Specification, number: int, folder: Path) -> int:
    """Fly one case again: what was drawn and measured is printed, and its log and a page about it are written.

    Args:
        specification: The campaign.
        number: Of the case.
        folder: Of the campaign.

    Raises:
        SitlError: There is no such case, or a file cannot be written.
    """
    from protocol.flight_log.flight_page import flight_page, require_plotly  # noqa: PLC0415
    from protocol.flight_log.flight_series import flight_series  # noqa: PLC0415
    from protocol.tlog import read_tlog  # noqa: PLC0415
    from sitl.day import fly_recorded, scenery_of  # noqa: PLC0415
    from sitl.lab.campaigns.case_flights import CaseAircraft, measured_case  # noqa: PLC0415
    from sitl.lab.campaigns.chunks import ChunkStore, write_durably  # noqa: PLC0415
    from sitl.lab.campaigns.specification import draw  # noqa: PLC0415

    case = draw(specification, number)
    store, aircraft, fault = ChunkStore(folder, specification), CaseAircraft(specification, case), ""
    title, path = f"{specification.name}, case {number}", store.folder / f"case-{number}.tlog"
    with TemporaryDirectory() as kept:
        try:
            fly_recorded(aircraft, Path(kept), lambda: aircraft.is_over)
        except SitlError as error:
            fault = str(error)
        told = [("Error", fault)] if fault else _told(specification, case.values, measured_case(aircraft).measures)
        told.insert(0, ("Seed", str(case.seed)))
        print("\n".join(f"{name:<24}{value}" for name, value in told))
        for log in Path(kept).glob("*.tlog"):
            write_durably(path, log.read_bytes())
            print(f"written: {path}")
            try:
                require_plotly()
                series = flight_series(read_tlog(log), title)
                page = flight_page(series, title=title, scenery=scenery_of(specification.files.arena), preamble=told)
            except ProtocolError as missing:
                print(f"no page: {missing}", file=sys.stderr)
                continue
            write_durably(path.with_suffix(".html"), page.encode())
            print(f"written: {path.with_suffix('.html')}")
    return 0


def _told(
    specification: Specification, values: Mapping[str, Any], measures: tuple[float, ...]
) -> list[tuple[str, str]]:
    """The draws and measures of a case, in words."""
    drawn = [(name, value if isinstance(value, str) else f"{value:.6g}") for name, value in values.items()]
    found = zip(specification.measures.items(), measures, strict=True)
    return drawn + [
        (name, f"{value:.6g} {measure.unit}".strip() if math.isfinite(value) else "none")
        for (name, measure), value in found
    ]
