"""Named experiments."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from sitl.errors import SitlError

if TYPE_CHECKING:
    from sitl.studies.reproduction.experiment import Experiment, Row
    from sitl.studies.scenario import Figure, Scenario, Track


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl scenario``."""
    made = argparse.ArgumentParser(
        prog="darko-sitl scenario",
        description=commands["scenario"] + ".",
        epilog="Single flights also run live, with a ground station watching: darko-sitl --scenario NAME.",
    )
    made.add_argument("name", nargs="?", help="which one, or 'all'; without a name they are listed")
    made.add_argument(
        "--plot",
        type=Path,
        metavar="FILE",
        help="where the plot goes: .png, .svg or .pdf; studies draw .svg [NAME.png]",
    )
    made.add_argument("--no-plot", action="store_true", help="print the figures only")
    made.add_argument("--json", action="store_true", help="print the figures for a program")
    made.add_argument("--airframe", metavar="SET", help="parameter set or TOML file of a flight [the scenario's own]")
    made.add_argument("--seed", type=int, default=1, metavar="N")
    return made


def run(args: argparse.Namespace) -> int:
    """List the experiments or run some; exit code 1 if a figure misses what is expected and nothing explains it."""
    from sitl.studies.report import SCENARIOS  # noqa: PLC0415 - --help must not load the compiler
    from sitl.studies.reproduction.catalogue import EXPERIMENTS  # noqa: PLC0415

    studies = {name: experiment for name, experiment in EXPERIMENTS.items() if name not in SCENARIOS}
    if args.name is None:
        entries = [(s.name, s.title, s.claim) for s in SCENARIOS.values()]
        entries += [(e.name, e.title, f"report {e.place}: a study of several runs") for e in studies.values()]
        for name, title, claim in entries:
            print(f"{name:<17} {title}\n{'':<17} {claim}")
        return 0
    names = [*SCENARIOS, *studies] if args.name == "all" else [args.name]
    if args.name not in {"all", *SCENARIOS, *studies}:
        raise SitlError(f"no scenario {args.name!r}: there are {', '.join((*SCENARIOS, *studies))}")
    if len(names) > 1 and args.plot is not None:
        raise SitlError("--plot names one file, and 'all' draws many: leave it out, or choose --no-plot")
    return max(_fly(SCENARIOS[name], args) if name in SCENARIOS else _study(studies[name], args) for name in names)


def _fly(scenario: Scenario, args: argparse.Namespace) -> int:
    from sitl.studies.plot import save_plot  # noqa: PLC0415 - --help must not load matplotlib
    from sitl.studies.scenario import fly  # noqa: PLC0415

    track = fly(scenario, seed=args.seed, airframe=args.airframe)
    figures = scenario.figures(track)
    print(_as_json(scenario, track, figures) if args.json else as_text(scenario, track, figures))
    if not args.no_plot:
        path = args.plot or Path(f"{scenario.name}.png")
        save_plot(scenario, track, path)
        if not args.json:
            print(f"  plot: {path}")
    return 0 if all(figure.holds for figure in figures) else 1


def _study(experiment: Experiment, args: argparse.Namespace) -> int:
    if args.airframe is not None:
        raise SitlError(f"{experiment.name} compares airframes of its own: --airframe is for single flights")
    rows, panels = experiment.run(args.seed)
    print(_rows_as_json(experiment, rows) if args.json else _rows_as_text(experiment, rows))
    for number, panel in enumerate(() if args.no_plot else panels, 1):
        base = (args.plot or Path(experiment.name)).with_suffix("")
        path = base.with_name(f"{base.name}-{number}.svg")
        try:
            path.write_text(panel.svg, encoding="utf-8")
        except OSError as error:
            raise SitlError(f"plot {path}: {error.strerror}") from error
        if not args.json:
            print(f"  plot: {path}")
    return 0 if all(row.explained for row in rows) else 1


def as_text(scenario: Scenario, track: Track, figures: list[Figure]) -> str:
    """A flight's figures with their verdicts, its jumps, and how fast it ran."""
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


def _rows_as_text(experiment: Experiment, rows: list[Row]) -> str:
    lines = [f"{experiment.name}: {experiment.title}", f"  report {experiment.place}"]
    for row in rows:
        figure = row.figure
        lines.append(
            f"  {figure.name:<64}{figure.value:10.4g} {figure.unit:<7} [{row.verdict}; report: {figure.expected}]"
        )
        if row.cause:
            lines.append(f"      {row.cause}")
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


def _rows_as_json(experiment: Experiment, rows: list[Row]) -> str:
    return json.dumps(
        {
            "scenario": experiment.name,
            "figures": [
                row.figure._asdict()
                | {
                    "value": row.figure.value if math.isfinite(row.figure.value) else None,
                    "holds": bool(row.figure.holds),
                    "place": row.place,
                    "verdict": row.verdict,
                    "cause": row.cause,
                }
                for row in rows
            ],
        },
        default=float,
    )
