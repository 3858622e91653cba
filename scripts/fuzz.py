"""Fuzz both ends of a link: mutate the stored corpus, guided by the code that the bytes reach.

``python scripts/fuzz.py --seconds 600`` runs that long; inputs that reach new code are stored in
``tests/data/fuzz_corpus.txt``, which the tests replay. An input that raises an error is printed as hexadecimal
digits, and the exit code is 1; ``--replay DIGITS`` runs it again.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
import traceback
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from sitl.tools.error_guard import ErrorGuard
from tests.support.links import fuzz as harness


def main() -> int:
    """Fuzz, and print the result."""
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--seconds", type=float, default=60.0, help="how long to run [60]")
    made.add_argument("--seed", type=int, default=1, help="seed of the mutations [1]")
    made.add_argument("--replay", metavar="DIGITS", help="run one input only")
    args = made.parse_args()
    ErrorGuard.raises = True  # an error that the vehicle would report, and fly on, is a finding
    if args.replay is not None:
        harness.run(bytes.fromhex(args.replay))
        return 0
    return search(args.seconds, random.Random(args.seed))  # noqa: S311 - to be repeated


def search(seconds: float, draw: random.Random) -> int:
    """Mutate and run until the time is over; exit code."""
    corpus: list[bytes] = []
    seen: set[tuple[str, int, int]] = set()
    waiting = harness.read_corpus()  # shortest first: inputs that reach nothing new are dropped
    runs, end = 0, time.monotonic() + seconds
    while waiting or time.monotonic() < end:
        fresh = not corpus or draw.random() < 0.1
        data = waiting.pop(0) if waiting else harness.fresh(draw) if fresh else harness.mutated(draw, corpus)
        try:
            new = harness.covered(data) - seen
        except Exception:  # any exception is a finding
            traceback.print_exc()
            print(f"broken by: {data.hex()}")
            return 1
        runs += 1
        if new:
            seen |= new
            corpus.append(data)
    harness.write_corpus(corpus)
    size = sum(map(len, corpus)) / 1000
    print(f"{runs} runs, {len(seen)} jumps between lines reached, {len(corpus)} inputs kept ({size:.1f} kB)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
