"""Falls from any attitude, and how they end."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from sitl.commands.study_commands.seeded_options import check_seeded, craft_of, write_json
from sitl.lab.studies.falls import falls, falls_of_aircraft
from sitl.lab.studies.falls.falls import HeightLost, MapCell
from sitl.lab.studies.falls.falls_of_aircraft import AircraftFall, FallEnd, count
from sitl.lab.studies.falls.falls_plot import save_plot
from sitl.tools.plotting import check_plot_path

MAX_WINDY_CRASHES = 0.03  # share of the falls in wind


def run(args: argparse.Namespace) -> int:
    """Fly the falls and print their figures; exit code 1 if one needs more height than it should or too many crash."""
    check_seeded(args, {}, ["draws"])
    if args.plot is not None:
        check_plot_path(args.plot)

    craft = craft_of(args)
    model = craft.model
    heights = falls.heights(model, args.draws, args.first, craft.tuning)
    print(f"{args.draws} draws, seeds {args.first} to {args.first + args.draws - 1}; median, 95 %, worst")
    print("\n".join(falls.summary(heights)), flush=True)
    cells = falls.height_map(model, args.draws, args.first, craft.tuning)
    print("\nmedian / 95 % / worst")
    print("\n".join(falls.map_lines(cells)), flush=True)
    ends = []
    for windy in (False, True):
        ends.append(falls_of_aircraft.run(args.flights, args.first, craft, windy=windy, jobs=args.jobs))
        air = (
            f"wind {falls_of_aircraft.FALL_WIND:g} m/s, gusts {falls_of_aircraft.FALL_GUSTS:g} m/s"
            if windy
            else "still air"
        )
        print(f"\nWhole vehicle, {air}:")
        print("\n".join(falls_of_aircraft.summary(ends[-1])), flush=True)
    if args.json is not None:
        write_json(args.json, _rows(heights, cells, ends))
    if args.plot is not None:
        save_plot(heights, cells, args.plot)
    return 0 if passed(heights, *ends) else 1


def passed(heights: Sequence[HeightLost], calm: Sequence[AircraftFall], windy: Sequence[AircraftFall]) -> bool:
    """Whether no fall needs more height than under the law alone, all end at home, and few crash in wind."""
    caught = not any(result.worse or result.not_home for result in heights)
    return (
        caught
        and count(calm, FallEnd.HOME) == len(calm)
        and count(windy, FallEnd.CRASHED) <= MAX_WINDY_CRASHES * len(windy)
    )


def _rows(
    heights: Sequence[HeightLost], cells: Sequence[MapCell], ends: Sequence[Sequence[AircraftFall]]
) -> dict[str, object]:
    return {
        "heights": [{"kind": r.kind, "supervisor": r.supervisor.tolist(), "alone": r.alone.tolist()} for r in heights],
        "map": [{"sink": c.sink, "tumble": c.tumble, "lost": c.lost.tolist()} for c in cells],
        "calm": [fall._asdict() for fall in ends[0]],
        "windy": [fall._asdict() for fall in ends[1]],
    }
