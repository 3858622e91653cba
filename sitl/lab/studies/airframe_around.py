"""Check of the airframes around one: of other sizes, and with constants that are other by a fifth.

Nothing is tuned for any of them: what passes shows how far the design by an airframe's constants carries. A variant
that no airframe can be, as a propeller that gives more power than it takes, is refused by its file and not counted.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from sitl import SitlError, load_airframe
from sitl.lab.studies.airframe_check import CheckRow, check_airframe
from sitl.lab.studies.airframe_variants import Variant, write_all
from sitl.lab.studies.seeded_flights import fly_draws, print_progress

WORKERS = max((os.cpu_count() or 2) // 2, 1)


class CheckedVariant(NamedTuple):
    """Result of one variant."""

    name: str
    rows: tuple[CheckRow, ...]  # none where it is refused
    refusal: str = ""

    @property
    def missed(self) -> list[CheckRow]:
        """The rows that miss their limits."""
        return [row for row in self.rows if not row.passed]


def check_variant(variant: Variant, seed: int) -> CheckedVariant:
    """All rows of one variant, or why there is no such airframe."""
    try:
        load_airframe(variant.path)
    except SitlError as error:
        return CheckedVariant(variant.name, (), str(error).replace(variant.path, "").strip(": "))
    return CheckedVariant(variant.name, tuple(check_airframe(variant.path, seed)))


def around_summary(checked: Sequence[CheckedVariant]) -> list[str]:
    """The variants as a table: what each misses, and how many pass."""
    width = max(len(one.name) for one in checked) + 2
    lines = [f"{one.name:<{width}}{_verdict(one)}" for one in checked]
    there = [one for one in checked if not one.refusal]
    passed = sum(not one.missed for one in there)
    return [*lines, "", f"{passed} of {len(there)} passed; {len(checked) - len(there)} are no airframes"]


def _verdict(one: CheckedVariant) -> str:
    if one.refusal:
        return f"none: {one.refusal}"
    missed = "; ".join(f"{row.name} {row.value}, must be {row.limit}" for row in one.missed)
    return f"NO    {missed}" if missed else "ok"


def run_around(args: argparse.Namespace) -> int:
    """Check all variants of the airframe that is named; 1 if one of them misses a limit."""
    with TemporaryDirectory() as folder:
        variants = list(write_all(load_airframe(args.file), Path(folder)))
        check = partial(check_variant, seed=args.seed)
        checked = fly_draws(check, variants, WORKERS, on_progress=lambda done: print_progress(done, len(variants)))
    print("\n".join(around_summary(checked)))
    return 1 if any(one.missed for one in checked) else 0
