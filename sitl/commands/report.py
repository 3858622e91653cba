"""The report reproduced: every experiment, on one page."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from protocol.errors import FileError
from protocol.tools.atomic_write import write_atomically
from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import whole_number
from sitl.errors import SitlError
from sitl.tools.plotting import require_matplotlib

if TYPE_CHECKING:
    from sitl.lab.reproduction.experiment import Experiment
    from sitl.lab.reproduction.html_page import Provenance

LIBRARIES = ("numpy", "scipy", "numba", "matplotlib")  # named on the page


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl study report``."""
    options = CommandParser(prog="darko-sitl study report", description=commands["report"] + ".")
    options.add_argument(
        "-o", "--output", type=Path, default=Path("report.html"), metavar="FILE", help="where to write it [report.html]"
    )
    options.add_argument(
        "--only", nargs="+", metavar="NAME", help="run only these experiments; 'darko-sitl study scenario' lists them"
    )
    options.add_argument("--jobs", type=whole_number, default=2, metavar="N", help="processes at once [2]")
    options.add_argument("--seed", type=whole_number, default=1, metavar="N", help="seed of random draws [1]")
    return options


def run(args: argparse.Namespace) -> int:
    """Run the experiments and write the page; exit code 1 if a difference is unexplained."""
    if args.jobs < 1:
        raise SitlError(f"--jobs {args.jobs}: at least one process is needed")
    if not args.output.parent.is_dir():
        raise SitlError(f"{args.output}: there is no folder {args.output.parent}")
    require_matplotlib()
    from sitl.lab.reproduction.errata import errata  # noqa: PLC0415 - --help must be quick
    from sitl.lab.reproduction.experiment import Conditions, failures  # noqa: PLC0415
    from sitl.lab.reproduction.experiments.experiment_list import chosen, run_all  # noqa: PLC0415
    from sitl.lab.reproduction.html_page import cause_in_words, counts, ours, page  # noqa: PLC0415

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
    from sitl.lab.reproduction.html_page import Provenance  # noqa: PLC0415
    from sitl.model.airframe_files import load  # noqa: PLC0415

    libraries = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    names = sorted({name for experiment in experiments for name in experiment.airframes})
    return Provenance(version("darko"), libraries, seed, [(name, load(name).sha256) for name in names])
