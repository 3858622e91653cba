"""Scenarios and experiments of the report, by name."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path

from sitl.errors import SitlError
from sitl.lab.reproduction.experiment import Conditions, Experiment, ExperimentResult, failures
from sitl.lab.reproduction.experiments.experiment_list import EXPERIMENTS
from sitl.lab.reproduction.html_page import cause_in_words
from sitl.lab.scenarios.catalogue import SCENARIOS
from sitl.lab.scenarios.flight_plot import save_plot
from sitl.lab.scenarios.scenario import Finding, Scenario, Track, as_text, fly
from sitl.tools.plotting import require_matplotlib


def run(args: argparse.Namespace) -> int:
    """List the experiments or run some; exit code 1 if a figure is not as expected and nothing explains it."""
    experiments = {name: experiment for name, experiment in EXPERIMENTS.items() if name not in SCENARIOS}
    if args.name is None:
        entries = [(s.name, s.title, s.claim) for s in SCENARIOS.values()]
        entries += [(e.name, e.title, f"report {e.place}: an experiment of several runs") for e in experiments.values()]
        for name, title, claim in entries:
            print(f"{name:<17} {title}\n{'':<17} {claim}")
        return 0
    names = [*SCENARIOS, *experiments] if args.name == "all" else [args.name]
    if args.name not in {"all", *SCENARIOS, *experiments}:
        raise SitlError(f"no scenario {args.name!r}: there are {', '.join((*SCENARIOS, *experiments))}")
    if not (args.no_plot and all(name in SCENARIOS for name in names)):  # experiments of several runs always draw
        require_matplotlib()
    if len(names) > 1 and args.plot is not None:
        raise SitlError("--plot names one file, but 'all' draws several: leave it out or use --no-plot")
    return max(
        _fly(SCENARIOS[name], args) if name in SCENARIOS else _run_experiment(experiments[name], args) for name in names
    )


def _fly(scenario: Scenario, args: argparse.Namespace) -> int:
    track = fly(scenario, seed=args.seed, airframe=args.airframe)
    findings = scenario.findings(track)
    print(_as_json(scenario, track, findings) if args.json else as_text(scenario, track, findings))
    if not args.no_plot:
        path = args.plot or Path(f"{scenario.name}.png")
        save_plot(scenario, track, path)
        if not args.json:
            print(f"  plot: {path}")
    return 0 if all(finding.holds for finding in findings) and not track.crashed else 1


def _run_experiment(experiment: Experiment, args: argparse.Namespace) -> int:
    if args.airframe is not None:
        raise SitlError(f"{experiment.name} chooses its own airframes: --airframe is for single flights")

    result = experiment.run(Conditions(args.seed))
    print(_result_as_json(experiment, result) if args.json else _result_as_text(experiment, result))
    for number, panel in enumerate(() if args.no_plot else result.panels, 1):
        base = (args.plot or Path(experiment.name)).with_suffix("")
        path = base.with_name(f"{base.name}-{number}.svg")
        try:
            path.write_text(panel.svg, encoding="utf-8")
        except OSError as error:
            raise SitlError(f"plot {path}: {error.strerror}") from error
        if not args.json:
            print(f"  plot: {path}")
    return 1 if failures(result.statements) else 0


def _result_as_text(experiment: Experiment, result: ExperimentResult) -> str:
    lines = [f"{experiment.name}: {experiment.title}", f"  report {experiment.place}"]
    for statement in result.statements:
        lines.append(
            f"  {statement.name:<64}{statement.value:10.4g} {statement.unit:<7} [{statement.verdict}; report: "
            f"{statement.expected.text}]"
        )
        lines += [f"      {text}"] if (text := cause_in_words(statement)) else []
    for row in result.illustrations:
        lines.append(f"  {row.name:<64}{row.value:10.4g} {row.unit:<7} [illustration; report: {row.report}]")
    return "\n".join(lines)


def _as_json(scenario: Scenario, track: Track, findings: list[Finding]) -> str:
    return json.dumps(
        {
            "ok": all(finding.holds for finding in findings) and not track.crashed,
            "scenario": scenario.name,
            "figures": [finding._asdict() | {"holds": bool(finding.holds)} for finding in findings],
            "jumps": [
                {"time": jump.time, "from": jump.source.name, "to": jump.target.name, "name": jump.name}
                for jump in track.jumps
            ],
            "crashed": track.crashed,
            "times_real_time": scenario.duration / track.wall_time,
        },
        default=float,
    )


def _result_as_json(experiment: Experiment, result: ExperimentResult) -> str:
    figures = [
        {
            "name": statement.name,
            "value": _finite(statement.value),
            "unit": statement.unit,
            "expected": statement.expected.text,
            "place": statement.place,
            "verdict": statement.verdict,
            "cause": cause_in_words(statement),
        }
        for statement in result.statements
    ]
    illustrations = [row._asdict() | {"value": _finite(row.value)} for row in result.illustrations]
    told = {"ok": not failures(result.statements), "scenario": experiment.name}
    return json.dumps({**told, "figures": figures, "illustrations": illustrations}, default=float)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
