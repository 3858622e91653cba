"""The seeded campaign of missions in forward flight."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sitl.defaults import AIRFRAME
from sitl.errors import SitlError
from sitl.plotting import check_plot_path

if TYPE_CHECKING:
    from sitl.studies.campaign import CampaignFlight

MIN_COMPLETE = 0.97  # share of the flights that must complete
PROGRESS_INTERVAL = 10  # flights between two progress lines


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl campaign``."""
    options = argparse.ArgumentParser(prog="darko-sitl campaign", description=commands["campaign"] + ".")
    options.add_argument("--flights", type=int, default=200, metavar="N", help="how many flights [200]")
    options.add_argument("--first", type=int, default=1, metavar="SEED", help="seed of the first flight [1]")
    options.add_argument("--jobs", type=int, default=2, metavar="N", help="processes at once [2]")
    options.add_argument("--wind", type=float, default=5.0, metavar="M/S", help="maximum steady wind [5]")
    options.add_argument("--gusts", type=float, default=1.0, metavar="RMS", help="maximum gusts per axis, m/s rms [1]")
    options.add_argument(
        "--parameters",
        type=float,
        default=0.1,
        metavar="SHARE",
        help="maximum relative error of the design model [0.1]",
    )
    options.add_argument("--airframe", default=AIRFRAME, metavar="SET", help=f"set or TOML file to fly [{AIRFRAME}]")
    options.add_argument("--plot", type=Path, metavar="FILE", help="also draw the results: .png, .svg or .pdf")
    options.add_argument("--json", type=Path, metavar="FILE", help="also write every flight as JSON")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly the campaign and print its figures; exit code 1 if too many fail or one flies too low."""
    _check(args)
    from sitl.studies import campaign  # noqa: PLC0415 - --help must not load the compiler

    spread = campaign.Spread(args.wind, args.gusts, args.parameters)
    results = campaign.run(
        args.flights,
        args.first,
        spread,
        args.jobs,
        on_progress=lambda done: _print_progress(done, args.flights),
        airframe=args.airframe,
    )
    print("\n".join(campaign.summary(results)), flush=True)
    if args.json is not None:
        _write(results, args.json)
    if args.plot is not None:
        from sitl.studies.campaign_plot import save_plot  # noqa: PLC0415

        save_plot(results, args.plot)
    return 0 if passed(results, campaign.MIN_FLIGHT_HEIGHT) else 1


def passed(results: Sequence[CampaignFlight], lowest: float) -> bool:
    """Whether enough flights are complete and all stayed above an altitude [m]."""
    complete = sum(result.complete for result in results)
    return complete >= MIN_COMPLETE * len(results) and all(result.lowest >= lowest for result in results)


def _check(args: argparse.Namespace) -> None:
    """Refuse bad arguments before any flight."""
    if args.first < 0:
        raise SitlError(f"--first {args.first}: seeds are not negative")
    for name, maximum in (("wind", 30.0), ("gusts", 10.0), ("parameters", 0.5)):
        value = getattr(args, name)
        if not 0.0 <= value <= maximum:
            raise SitlError(f"--{name} {value:g} is not within 0 and {maximum:g}")
    if args.plot is not None:
        check_plot_path(args.plot)
    if args.json is not None and not args.json.parent.is_dir():
        raise SitlError(f"{args.json}: there is no folder {args.json.parent}")


def _print_progress(done: int, of: int) -> None:
    if done % PROGRESS_INTERVAL == 0 or done == of:
        print(f"{done}/{of} flown", file=sys.stderr, flush=True)


def _write(results: Sequence[CampaignFlight], path: Path) -> None:
    rows = [result._asdict() | {"draw": result.draw._asdict()} for result in results]
    try:
        path.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise SitlError(f"{path}: {error.strerror}") from error
