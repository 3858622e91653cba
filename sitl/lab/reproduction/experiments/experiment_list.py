"""The experiments in the document's order, run one by one or all for the page."""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from importlib.metadata import version
from pathlib import Path

from protocol.errors import FileError
from protocol.tools.files import write_atomically
from sitl import SitlError, load_airframe
from sitl.lab.reproduction.errata import errata
from sitl.lab.reproduction.experiment import Conditions, Experiment, ExperimentResult, failures
from sitl.lab.reproduction.experiments.actuator_experiments import ACTUATOR_LAG, ACTUATOR_LIMITS
from sitl.lab.reproduction.experiments.hover_flights import (
    BACK_TRANSITION,
    FAR_TARGET,
    HOVER_FLIGHT,
    LINEAR_DOMAIN,
    LQI_IN_WIND,
)
from sitl.lab.reproduction.experiments.nu_redefinition import NU_REDEFINITION
from sitl.lab.reproduction.experiments.printed_numbers import PRINTED_NUMBERS
from sitl.lab.reproduction.experiments.vertical_plane import GOVERNOR_SIGMOIDS, VERTICAL_PLANE
from sitl.lab.reproduction.experiments.wing_shapes import WING_SHAPES
from sitl.lab.reproduction.html_page import LIBRARIES, Provenance, cause_in_words, counts, kinds, ours, page
from sitl.lab.scenarios import SCENARIOS, Finding, Scenario, Track, as_text, fly, save_plot
from sitl.lab.studies.seeded_flights import worker_pool
from sitl.tools.plotting import require_matplotlib

# The experiments in the document's order, and how several are run at once.

EXPERIMENTS: dict[str, Experiment] = {
    experiment.name: experiment
    for experiment in (
        ACTUATOR_LIMITS,
        PRINTED_NUMBERS,
        LQI_IN_WIND,
        LINEAR_DOMAIN,
        GOVERNOR_SIGMOIDS,
        HOVER_FLIGHT,
        VERTICAL_PLANE,
        FAR_TARGET,
        BACK_TRANSITION,
        ACTUATOR_LAG,
        WING_SHAPES,
        NU_REDEFINITION,
    )
}
SLOWEST_FIRST = ("motors", "vertical-plane")  # so that no core waits for the last one alone


def chosen(names: Sequence[str] | None) -> list[Experiment]:
    """The experiments of these names in the document's order; all of them if no name is given.

    Raises:
        SitlError: If there is no such experiment.
    """
    for name in names or ():
        if name not in EXPERIMENTS:
            raise SitlError(f"no experiment {name!r}: there are {', '.join(EXPERIMENTS)}")
    return [experiment for name, experiment in EXPERIMENTS.items() if not names or name in names]


def run_one(name: str, seed: int) -> tuple[ExperimentResult, float]:
    """Run an experiment; its result and how long it took [s]."""
    began = time.perf_counter()
    result = EXPERIMENTS[name].run(Conditions(seed))
    return result, time.perf_counter() - began


def run_all(
    experiments: Sequence[Experiment], seed: int, jobs: int, on_progress: Callable[[str], None]
) -> dict[str, ExperimentResult]:
    """Run experiments, several processes at once; results by name.

    Args:
        experiments: To run.
        seed: Of every random draw in them.
        jobs: Processes at once.
        on_progress: Called with a line of text for each finished experiment.
    """
    order = sorted((e.name for e in experiments), key=lambda name: name not in SLOWEST_FIRST)
    results: dict[str, ExperimentResult] = {}

    def add(name: str, result: ExperimentResult, took: float) -> None:
        results[name] = result
        on_progress(f"{len(results)}/{len(order)} {name}: {len(result.statements)} statements, {took:.1f} s")

    if jobs == 1 or len(order) == 1:
        for name in order:
            add(name, *run_one(name, seed))
        return results
    with worker_pool(min(jobs, len(order))) as pool:
        waiting = {pool.submit(run_one, name, seed): name for name in order}
        for future in as_completed(waiting):
            add(waiting[future], *future.result())
    return results


def study_scenario(args: argparse.Namespace) -> int:
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


def study_report(args: argparse.Namespace) -> int:
    """Run the experiments and write the page; exit code 1 if a difference is unexplained."""
    if args.jobs < 1:
        raise SitlError(f"--jobs {args.jobs}: at least one process is needed")
    if not args.output.parent.is_dir():
        raise SitlError(f"{args.output}: there is no folder {args.output.parent}")
    require_matplotlib()

    experiments = chosen(args.only)
    results = run_all(
        experiments, args.seed, args.jobs, on_progress=lambda text: print(text, file=sys.stderr, flush=True)
    )
    text = page(experiments, results, errata(Conditions(args.seed)), _provenance(experiments, args.seed))
    try:
        write_atomically(args.output, text.encode())
    except FileError as error:
        raise SitlError(str(error)) from error
    statements = [statement for result in results.values() for statement in result.statements]
    unexplained = failures(statements)
    for row in unexplained:
        print(
            f"unexplained: {row.place}, {row.name}: the report {row.expected.text}, here {ours(row)}. "
            f"{cause_in_words(row)}",
            file=sys.stderr,
        )
    print(f"{len(statements)} statements: {counts(statements)}; agree: {kinds(statements)}", file=sys.stderr)
    print(args.output)
    return 1 if unexplained else 0


def _provenance(experiments: Sequence[Experiment], seed: int) -> Provenance:
    libraries = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    names = sorted({name for experiment in experiments for name in experiment.airframes})
    return Provenance(version("darko"), libraries, seed, [(name, load_airframe(name).sha256) for name in names])
