"""The seeded campaign of missions on the wing."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sitl.errors import SitlError

if TYPE_CHECKING:
    from sitl.studies.campaign import Result

MIN_COMPLETE = 0.97  # share of the flights that must complete
DRAWABLE = (".png", ".svg", ".pdf")
EVERY = 10  # flights between words of progress


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl campaign``."""
    made = argparse.ArgumentParser(prog="darko-sitl campaign", description=commands["campaign"] + ".")
    made.add_argument("--flights", type=int, default=200, metavar="N", help="[200]")
    made.add_argument("--first", type=int, default=1, metavar="SEED", help="seed of the first flight [1]")
    made.add_argument("--jobs", type=int, default=2, metavar="N", help="processes at once [2]")
    made.add_argument("--wind", type=float, default=5.0, metavar="M/S", help="maximum steady wind [5]")
    made.add_argument("--gusts", type=float, default=1.0, metavar="RMS", help="maximum gusts per axis, m/s rms [1]")
    made.add_argument(
        "--parameters",
        type=float,
        default=0.1,
        metavar="SHARE",
        help="maximum relative error of the design model [0.1]",
    )
    made.add_argument("--plot", type=Path, metavar="FILE", help="draw it as well: .png, .svg or .pdf")
    made.add_argument("--json", type=Path, metavar="FILE", help="write every flight, for a program")
    return made


def run(args: argparse.Namespace) -> int:
    """Fly the campaign and print its figures; exit code 1 if too many fail or one comes too low."""
    _check(args)
    from sitl.studies import campaign  # noqa: PLC0415 - --help must not load the compiler

    spread = campaign.Spread(args.wind, args.gusts, args.parameters)
    results = campaign.run(args.flights, args.first, spread, args.jobs, said=lambda done: _say(done, args.flights))
    print("\n".join(campaign.summary(results)), flush=True)
    if args.json is not None:
        _write(results, args.json)
    if args.plot is not None:
        from sitl.studies.campaign_plot import save_plot  # noqa: PLC0415

        save_plot(results, args.plot)
    return 0 if passed(results, campaign.MIN_HEIGHT) else 1


def passed(results: Sequence[Result], lowest: float) -> bool:
    """Whether enough flights are complete and none came below an altitude [m]."""
    complete = sum(result.complete for result in results)
    return complete >= MIN_COMPLETE * len(results) and all(result.lowest >= lowest for result in results)


def _check(args: argparse.Namespace) -> None:
    """Refuse what would be found out only after all the flights."""
    if args.first < 0:
        raise SitlError(f"--first {args.first}: seeds are not negative")
    for name, most in (("wind", 30.0), ("gusts", 10.0), ("parameters", 0.5)):
        value = getattr(args, name)
        if not 0.0 <= value <= most:
            raise SitlError(f"--{name} {value:g} is not within 0 and {most:g}")
    for path in (args.plot, args.json):
        if path is not None and not path.parent.is_dir():
            raise SitlError(f"{path}: there is no folder {path.parent}")
    if args.plot is not None and args.plot.suffix not in DRAWABLE:
        raise SitlError(f"{args.plot}: plots are {', '.join(DRAWABLE)}")


def _say(done: int, of: int) -> None:
    if done % EVERY == 0 or done == of:
        print(f"{done}/{of} flown", file=sys.stderr, flush=True)


def _write(results: Sequence[Result], path: Path) -> None:
    rows = [result._asdict() | {"draw": result.draw._asdict()} for result in results]
    try:
        path.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise SitlError(f"{path}: {error.strerror}") from error
