"""The seeded campaign of missions in forward flight."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    write_json,
)
from sitl.lab.studies import campaign
from sitl.lab.studies.campaign import CampaignFlight
from sitl.lab.studies.campaign_plot import save_plot
from sitl.tools.plotting import check_plot_path

MIN_COMPLETE = 0.97  # share of the flights that must complete


def run(args: argparse.Namespace) -> int:
    """Fly the campaign and print its figures; exit code 1 if too many fail or one flies too low."""
    check_seeded(args, {"wind": 30.0, "gusts": 10.0, "parameters": 0.5})
    if args.plot is not None:
        check_plot_path(args.plot)

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
        save_plot(results, craft_of(args), args.plot)
    return 0 if passed(results, campaign.MIN_FLIGHT_HEIGHT) else 1


def passed(results: Sequence[CampaignFlight], lowest: float) -> bool:
    """Whether enough flights are complete and all stayed above an altitude [m]."""
    complete = sum(result.complete for result in results)
    return complete >= MIN_COMPLETE * len(results) and all(result.lowest >= lowest for result in results)
