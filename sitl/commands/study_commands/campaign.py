"""The seeded campaign of missions in forward flight."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from protocol.tools.option_values import finite_number
from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    seeded_parser,
    write_json,
)
from sitl.tools.plotting import check_plot_path

if TYPE_CHECKING:
    from sitl.lab.studies.campaign import CampaignFlight

MIN_COMPLETE = 0.97  # share of the flights that must complete


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl study campaign``."""
    options = seeded_parser("campaign", commands["campaign"], 200, "how many flights")
    options.add_argument("--wind", type=finite_number, default=5.0, metavar="M/S", help="maximum steady wind [5]")
    options.add_argument(
        "--gusts", type=finite_number, default=1.0, metavar="RMS", help="maximum gusts per axis, m/s rms [1]"
    )
    options.add_argument(
        "--parameters",
        type=finite_number,
        default=0.1,
        metavar="SHARE",
        help="maximum relative error of the design model [0.1]",
    )
    options.add_argument("--plot", type=Path, metavar="FILE", help="also draw the results: .png, .svg or .pdf")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly the campaign and print its figures; exit code 1 if too many fail or one flies too low."""
    check_seeded(args, {"wind": 30.0, "gusts": 10.0, "parameters": 0.5})
    if args.plot is not None:
        check_plot_path(args.plot)
    from sitl.lab.studies import campaign  # noqa: PLC0415 - --help must not load the compiler

    spread = campaign.Spread(args.wind, args.gusts, args.parameters)
    results = campaign.run(
        args.flights,
        args.first,
        spread,
        args.jobs,
        on_progress=lambda done: print_progress(done, args.flights),
        craft=craft_of(args),
    )
    print("\n".join(campaign.summary(results)), flush=True)
    if args.json is not None:
        write_json(args.json, [result._asdict() | {"draw": result.draw._asdict()} for result in results])
    if args.plot is not None:
        from sitl.lab.studies.campaign_plot import save_plot  # noqa: PLC0415

        save_plot(results, craft_of(args), args.plot)
    return 0 if passed(results, campaign.MIN_FLIGHT_HEIGHT) else 1


def passed(results: Sequence[CampaignFlight], lowest: float) -> bool:
    """Whether enough flights are complete and all stayed above an altitude [m]."""
    complete = sum(result.complete for result in results)
    return complete >= MIN_COMPLETE * len(results) and all(result.lowest >= lowest for result in results)
