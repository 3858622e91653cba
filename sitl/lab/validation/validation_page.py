"""``darko-sitl study validate``: the flight and every published curve beside the simulator, as a page with verdicts."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

from protocol.errors import FileError
from protocol.tools.files import write_atomically
from sitl import Airframe, SitlError, load_airframe
from sitl.lab.reproduction.experiment import (
    Conditions,
    Expectation,
    Experiment,
    ExperimentResult,
    Panel,
    Statement,
    failures,
)
from sitl.lab.reproduction.flight_panels import SvgSheet
from sitl.lab.reproduction.html_page import LIBRARIES, Provenance, Wording, counts, kinds, ours, page
from sitl.lab.validation import assumed_spread, wall_fit
from sitl.lab.validation.curve_experiments import CURVE_EXPERIMENTS
from sitl.lab.validation.wall_flight import (
    ELEVON_LIMIT,
    PITCH_LIMIT,
    PITCH_RMS,
    THRUST_LIMIT,
    Comparison,
    compared,
    draw,
    faults,
    table,
)
from sitl.tools.plotting import require_matplotlib

VALIDATION_PAGE = Wording(
    "DarkO: the simulator beside the flight and beside its authors' curves",
    "Hover before a wind wall as F. Sansou's thesis (2024) flew it, beside the airframe's own trims; and the curves of "
    "fifteen figures of thesis and report (2021), read out of their vector paths, beside flights of their public code.",
    "published",
    "what it depends on is not public, as a sensor's noise, or the figure shows no more than its shape",
)
WALL_PLACE = "thesis 6"


def wall_experiment(name: str, rows: Sequence[Comparison], a: Airframe) -> Experiment:
    """The flight before the wind wall as an experiment.

    Args:
        name: Of the airframe's set.
        rows: Flight and model at each wind.
        a: The airframe.
    """
    text = (
        "Steady attitude, elevons and motors over the wind. The rows that are predicted took no part in any constant."
    )

    def run(_: Conditions) -> ExperimentResult:
        return ExperimentResult(wall_statements(rows), [_wall_panel(name, rows, a)])

    return Experiment("wall-flight", "The flight before the wind wall", WALL_PLACE, text, run, airframes=(name,))


def wall_statements(rows: Sequence[Comparison]) -> list[Statement]:
    """A statement for each number of the flight."""
    statements = []
    for row in rows:
        at = f"at {row.flown.wind:g} m/s, {'fitted to' if row.fitted else 'predicted'}"
        of_row = [
            _near(f"pitch {at}", row.flown.pitch, row.model.pitch, PITCH_LIMIT, "deg"),
            _near(f"elevons {at}", row.flown.elevon, row.model.elevon, ELEVON_LIMIT, "deg"),
        ]
        if not math.isnan(row.flown.thrust):
            of_row.append(
                _near(f"thrust {at}", row.flown.thrust, row.model.thrust, THRUST_LIMIT * row.flown.thrust, "N")
            )
        statements += [replace(statement, is_fitted=row.fitted) for statement in of_row]
    errors = [row.pitch_error for row in rows if not row.fitted]
    rms = math.sqrt(sum(error**2 for error in errors) / len(errors))
    expected = Expectation("the flight", 0.0, PITCH_RMS, f"rms at most {PITCH_RMS:g} deg")
    return [*statements, Statement(WALL_PLACE, "pitch where predicted: rms of the difference", expected, rms, "deg")]


def _near(name: str, flown: float, model: float, limit: float, unit: str) -> Statement:
    expected = Expectation(f"{flown:g}", flown - limit, flown + limit, f"± {limit:.3g} {unit}")
    return Statement(WALL_PLACE, name, expected, model, unit)


def _wall_panel(name: str, rows: Sequence[Comparison], a: Airframe) -> Panel:
    sheet = SvgSheet("wall-flight", 3, height=1.9)
    with sheet as axes:
        draw(axes, a, rows)
    worst = max(abs(row.pitch_error) for row in rows)
    return Panel("", f"{name}: hover before the wind wall", "circles and crosses.", f"Pitch within {worst:.1f} deg.",
                 sheet.svg)  # fmt: skip


def results_of(experiments: Sequence[Experiment], on_progress: Callable[[str], None]) -> dict[str, ExperimentResult]:
    """Run the experiments one after the other; results by name."""
    results = {}
    for number, experiment in enumerate(experiments, 1):
        results[experiment.name] = experiment.run(Conditions())
        on_progress(f"{number}/{len(experiments)} {experiment.name}: {counts(results[experiment.name].statements)}")
    return results


def study_validate(args: argparse.Namespace) -> int:
    """Print flight and model, and write the page; exit code 1: the flight is missed or a difference is unexplained."""
    if args.output is not None:
        _check_page(args.output)
    airframe = load_airframe(args.airframe)
    rows = compared(airframe.parameters)
    print(f"{airframe.name}: hover before a wind wall, flight of F. Sansou's thesis (2024) beside the model")
    print("\n".join(table(rows)))
    missed = faults(rows)
    print("\n".join(f"missed {fault}" for fault in missed) or "every limit kept")
    _tell_more(args, airframe.parameters)
    if args.output is None:
        return 1 if missed else 0
    experiments = (wall_experiment(airframe.name, rows, airframe.parameters), *CURVE_EXPERIMENTS)
    results = results_of(experiments, lambda text: print(text, file=sys.stderr, flush=True))
    names = sorted({name for experiment in CURVE_EXPERIMENTS for name in experiment.airframes})
    sets = [(airframe.name, airframe.sha256), *((name, load_airframe(name).sha256) for name in names)]
    libraries = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    made_with = Provenance(version("darko"), libraries, Conditions().seed, sets)
    try:
        write_atomically(args.output, page(experiments, results, (), made_with, VALIDATION_PAGE).encode())
    except FileError as error:
        raise SitlError(str(error)) from error
    return _told([statement for result in results.values() for statement in result.statements], args, bool(missed))


def _check_page(path: Path) -> None:
    """Refuse what cannot be written before anything is flown."""
    if not path.parent.is_dir():
        raise SitlError(f"{path}: there is no folder {path.parent}")
    require_matplotlib()


def _tell_more(args: argparse.Namespace, a: Airframe) -> None:
    """Print what was fitted, fitted anew, and how far claims spread, where that is asked for."""
    if args.fit:
        print("\n".join(wall_fit.as_text(wall_fit.fit(a))))
    if args.spread is not None:
        print("\n".join(assumed_spread.as_text(assumed_spread.claims(a), assumed_spread.spread(a, args.spread))))


def _told(statements: Sequence[Statement], args: argparse.Namespace, missed: bool) -> int:
    unexplained = failures(statements)
    for row in unexplained:
        print(f"unexplained: {row.place}, {row.name}: {row.expected.text}, here {ours(row)}", file=sys.stderr)
    print(f"{len(statements)} statements: {counts(statements)}; agree: {kinds(statements)}", file=sys.stderr)
    print(f"wrote {args.output}")
    return 1 if missed or unexplained else 0
