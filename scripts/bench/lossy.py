"""Every transfer over a lossy link, many seeds of each, beside the plain protocol: a table for ``docs/hostile.md``.

Usage: python scripts/bench/lossy.py [--seeds N] [--only WORDS]

30 % of the frames are lost each way, 20 % come twice, 30 % out of order, all half a second late each way. Time is
virtual; line k = 0, 1... of the table has the seeds from 1000 k on. The plain protocol asks one question after the
other and repeats each five times: once after the waits that the mission protocol recommends (0.25 s for items, 1.5 s
for the rest), once after 1.5 s throughout.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.support.links.transfers import ANY, HOSTILE, TRANSFERS, Outcome, fly, plain, seeds

HEAD = (
    "| Transfer | Succeeded | Median | 95 % | Longest | Frames | Plain, 0.25 s items | Plain, 1.5 s | Its median |",
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
)


def row(name: str, count: int) -> str:
    """One line of the table; times are of those that succeeded, frames a multiple of the loss-free transfer's."""
    transfer, drawn = TRANSFERS[name], seeds(name, count)
    loss_free = fly(transfer, 0).frames
    ours = [fly(transfer, seed, **HOSTILE) for seed in drawn]
    spec = [plain(transfer.waits, seed, **HOSTILE) for seed in drawn]
    slow = [plain((ANY,) * len(transfer.waits), seed, **HOSTILE) for seed in drawn]
    times = _times(ours)
    frames = statistics.median([o.frames for o in ours]) / loss_free
    cells = (
        name,
        f"{len(times)} of {count}",
        f"{statistics.median(times):.1f} s" if times else "",
        f"{times[int(0.95 * (len(times) - 1))]:.1f} s" if times else "",
        f"{times[-1]:.1f} s" if times else "",
        f"{frames:.1f} x {loss_free}",
        str(len(_times(spec))),
        str(len(_times(slow))),
        f"{statistics.median(_times(slow)):.1f} s" if _times(slow) else "",
    )
    return "| " + " | ".join(cells) + " |"


def _times(outcomes: Sequence[Outcome]) -> list[float]:
    return sorted(outcome.time for outcome in outcomes if outcome.is_success)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=300, help="seeds of each transfer [300]")
    parser.add_argument("--only", default="", help="only transfers whose names contain this text")
    args = parser.parse_args()
    print(*HEAD, sep="\n")
    for name in TRANSFERS:
        if args.only in name:
            print(row(name, args.seeds), flush=True)


if __name__ == "__main__":
    main()
