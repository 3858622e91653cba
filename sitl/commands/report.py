"""The report, reproduced: every experiment, one page."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from sitl.errors import SitlError

if TYPE_CHECKING:
    from sitl.studies.reproduction.page import Provenance

AIRFRAMES = ("nominal", "nominal-first-order", "published", "report-table")  # that experiments fly
LIBRARIES = ("numpy", "scipy", "numba", "matplotlib")


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl report``."""
    made = argparse.ArgumentParser(prog="darko-sitl report", description=commands["report"] + ".")
    made.add_argument("-o", "--output", type=Path, default=Path("report.html"), metavar="FILE", help="[report.html]")
    made.add_argument("--only", nargs="+", metavar="NAME", help="these experiments; 'darko-sitl scenario' lists them")
    made.add_argument("--jobs", type=int, default=2, metavar="N", help="processes at once [2]")
    made.add_argument("--seed", type=int, default=1, metavar="N")
    return made


def run(args: argparse.Namespace) -> int:
    """Run the experiments and write the page; exit code 1 if a difference has no cause."""
    if args.jobs < 1:
        raise SitlError(f"--jobs {args.jobs}: at least one process is needed")
    if not args.output.parent.is_dir():
        raise SitlError(f"{args.output}: there is no folder {args.output.parent}")
    from sitl.studies.reproduction.catalogue import chosen, run_all  # noqa: PLC0415 - --help must not load the compiler
    from sitl.studies.reproduction.page import page  # noqa: PLC0415

    experiments = chosen(args.only)
    outcomes = run_all(experiments, args.seed, args.jobs, say=lambda text: print(text, file=sys.stderr, flush=True))
    _replace(args.output, page(experiments, outcomes, _provenance(args.seed)))
    unexplained = [row for outcome in outcomes.values() for row in outcome.rows if not row.explained]
    for row in unexplained:
        print(f"not explained: {row.place}, {row.figure.name}", file=sys.stderr)
    print(args.output)
    return 1 if unexplained else 0


def _provenance(seed: int) -> Provenance:
    from sitl.airframe import load  # noqa: PLC0415
    from sitl.studies.reproduction.page import Provenance  # noqa: PLC0415

    libraries = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    return Provenance(version("darko"), libraries, seed, [(name, load(name).sha256) for name in AIRFRAMES])


def _replace(path: Path, text: str) -> None:
    """Write the whole file or leave the old one."""
    new = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        new.write_text(text, encoding="utf-8")
        new.replace(path)
    except OSError as error:
        new.unlink(missing_ok=True)
        raise SitlError(f"{path}: {error.strerror}") from error
