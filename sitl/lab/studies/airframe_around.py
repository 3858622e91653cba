"""Check of the airframes around one: of other sizes, and with constants that are other by a fifth.

Nothing is tuned for any of them: what passes shows how far the design by an airframe's constants carries. Not counted
are a variant that no airframe can be, as a propeller that gives more power than it takes, which its file refuses, and
one that is too weak for the tests by its numbers, as with too little thrust, which is not flown.
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
from sitl.lab.studies.airframe_check import CheckRow, check_airframe, incapable
from sitl.lab.studies.airframe_variants import Variant, write_all
from sitl.lab.studies.seeded_flights import fly_draws, print_progress

WORKERS = max((os.cpu_count() or 2) // 2, 1)


class CheckedVariant(NamedTuple):
    """Result of one variant."""

    name: str
    rows: tuple[CheckRow, ...]  # none where it is refused
    refusal: str = ""

    @property
    def weakness(self) -> str:
        """Its own numbers that miss their limits, in words; empty if none."""
        return incapable(self.rows)

    @property
    def missed(self) -> list[CheckRow]:
        """The rows that miss their limits."""
        return [row for row in self.rows if not row.passed]


def check_variant(variant: Variant, seed: int) -> CheckedVariant:
    """All rows of one variant, its numbers alone if one of them misses, or why there is no such airframe."""
    try:
        load_airframe(variant.path)
    except SitlError as error:
        return CheckedVariant(variant.name, (), str(error).replace(variant.path, "").strip(": "))
    numbers = check_airframe(variant.path, fly=False)
    rows = numbers if incapable(numbers) else check_airframe(variant.path, seed)
    return CheckedVariant(variant.name, tuple(rows))


def around_summary(checked: Sequence[CheckedVariant]) -> list[str]:
    """The variants as a table: what each misses, and how many pass."""
    width = max(len(one.name) for one in checked) + 2
    lines = [f"{one.name:<{width}}{_verdict(one)}" for one in checked]
    refused, weak = sum(bool(one.refusal) for one in checked), sum(bool(one.weakness) for one in checked)
    passed = sum(bool(one.rows) and not one.missed for one in checked)
    able = len(checked) - refused - weak
    counts = f"{passed} of {able} passed; {weak} too weak in themselves; {refused} are no airframes"
    return [*lines, "", counts]


def _verdict(one: CheckedVariant) -> str:
    if one.refusal:
        return f"none: {one.refusal}"
    if one.weakness:
        return f"weak  {'; '.join(f'{row.name} {row.value}: {row.remedy}' for row in one.missed)}"
    missed = "; ".join(f"{row.name} {row.value}, must be {row.limit}" for row in one.missed)
    return f"NO    {missed}" if missed else "ok"


def run_around(args: argparse.Namespace) -> int:
    """Check all variants of the airframe that is named; 1 if one that is strong enough misses a limit."""
    with TemporaryDirectory() as folder:
        variants = list(write_all(load_airframe(args.file), Path(folder)))
        check = partial(check_variant, seed=args.seed)
        checked = fly_draws(check, variants, WORKERS, on_progress=lambda done: print_progress(done, len(variants)))
    print("\n".join(around_summary(checked)))
    return 1 if any(one.missed and not one.weakness for one in checked) else 0
