"""Named experiments."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from sitl.errors import SitlError

if TYPE_CHECKING:
    from sitl.studies.scenario import Figure, Scenario, Track


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl scenario``."""
    made = argparse.ArgumentParser(prog="darko-sitl scenario", description=commands["scenario"] + ".")
    made.add_argument("name", nargs="?", help="which one, or 'all'; without a name they are listed")
    made.add_argument("--plot", type=Path, metavar="FILE", help="where the plot goes: .png, .svg or .pdf [NAME.png]")
    made.add_argument("--no-plot", action="store_true", help="print the figures only")
    made.add_argument("--json", action="store_true", help="print the figures for a program")
    made.add_argument("--airframe", metavar="SET", help="parameter set or TOML file [the scenario's own]")
    made.add_argument("--seed", type=int, default=1, metavar="N")
    return made


def run(args: argparse.Namespace) -> int:
    """List the scenarios or fly some; exit code 1 if a figure misses what is expected of it."""
    from sitl.studies.report import SCENARIOS  # noqa: PLC0415 - --help must not load the compiler

    if args.name is None:
        for scenario in SCENARIOS.values():
            print(f"{scenario.name:<12} {scenario.title}\n{'':<12} {scenario.claim}")
        return 0
    if args.name == "all":
        chosen = list(SCENARIOS.values())
    elif args.name in SCENARIOS:
        chosen = [SCENARIOS[args.name]]
    else:
        raise SitlError(f"no scenario {args.name!r}: there are {', '.join(SCENARIOS)}")
    return max(_fly(scenario, args) for scenario in chosen)


def _fly(scenario: Scenario, args: argparse.Namespace) -> int:
    from sitl.studies.plot import save_plot  # noqa: PLC0415 - --help must not load matplotlib
    from sitl.studies.scenario import fly  # noqa: PLC0415

    track = fly(scenario, seed=args.seed, airframe=args.airframe)
    figures = scenario.figures(track)
    print(_as_json(scenario, track, figures) if args.json else _as_text(scenario, track, figures))
    if not args.no_plot:
        path = args.plot or Path(f"{scenario.name}.png")
        save_plot(scenario, track, path)
        if not args.json:
            print(f"  plot: {path}")
    return 0 if all(figure.holds for figure in figures) else 1


def _as_text(scenario: Scenario, track: Track, figures: list[Figure]) -> str:
    lines = [f"{scenario.name}: {scenario.title}", f"  {scenario.claim}"]
    for figure in figures:
        verdict = "" if not figure.expected else f"   [{'ok' if figure.holds else 'MISSED'}: {figure.expected}]"
        lines.append(f"  {figure.name:<32}{figure.value:10.3f} {figure.unit:<6}{verdict}")
    lines += [
        f"  jump {jump.number} at {jump.time:.2f} s: {jump.source.name} -> {jump.target.name} ({jump.name})"
        for jump in track.jumps
    ]
    lines.append(
        f"  {scenario.duration:.0f} s flown in {track.wall:.2f} s: {scenario.duration / track.wall:.0f}x real time"
    )
    return "\n".join(lines)


def _as_json(scenario: Scenario, track: Track, figures: list[Figure]) -> str:
    return json.dumps(
        {
            "scenario": scenario.name,
            "figures": [figure._asdict() | {"holds": bool(figure.holds)} for figure in figures],
            "jumps": [
                {"time": jump.time, "from": jump.source.name, "to": jump.target.name, "name": jump.name}
                for jump in track.jumps
            ],
            "times_real_time": scenario.duration / track.wall,
        },
        default=float,
    )
