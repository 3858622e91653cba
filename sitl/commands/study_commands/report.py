"""The report reproduced: every experiment, on one page."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib.metadata import version

from protocol.errors import FileError
from protocol.tools.atomic_write import write_atomically
from sitl.errors import SitlError
from sitl.lab.reproduction.errata import errata
from sitl.lab.reproduction.experiment import Conditions, Experiment, failures
from sitl.lab.reproduction.experiments.experiment_list import chosen, run_all
from sitl.lab.reproduction.html_page import Provenance, cause_in_words, counts, ours, page
from sitl.model.airframe_files import load
from sitl.tools.plotting import require_matplotlib

LIBRARIES = ("numpy", "scipy", "numba", "matplotlib")  # named on the page


def run(args: argparse.Namespace) -> int:
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
    print(f"{len(statements)} statements: {counts(statements)}", file=sys.stderr)
    print(args.output)
    return 1 if unexplained else 0


def _provenance(experiments: Sequence[Experiment], seed: int) -> Provenance:
    libraries = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    names = sorted({name for experiment in experiments for name in experiment.airframes})
    return Provenance(version("darko"), libraries, seed, [(name, load(name).sha256) for name in names])
