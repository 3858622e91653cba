"""Measure seeks in a long recording: ``python scripts/bench/seeks.py [COPIES]``.

The recording is the square of the tests, flown COPIES times over [240], on clocks that go on.
"""

from __future__ import annotations

import random
import struct
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from darko_gcs.feed.replay_feed import ReplayFeed
from protocol.tlog import TlogReader, read_tlog
from protocol.wire.message_frames import make_frame

FLIGHT = Path(__file__).resolve().parents[2] / "tests" / "data" / "square-flight.tlog"
PLACES, SEED = 300, 2
PAUSE = 100  # between two copies, on the vehicle's clock [ms]


def repeated(copies: int) -> Iterator[bytes]:
    """The records of the vehicle in the square, again and again."""
    reader = read_tlog(FLIGHT)
    decoded = ((time_usec, reader.decode(row)) for row, (time_usec, _) in enumerate(reader.records()))
    flight = [(time_usec, m) for time_usec, m in decoded if m is not None and m.get_srcSystem() == 1]
    boots = [m.time_boot_ms for _, m in flight if hasattr(m, "time_boot_ms")]
    lasts, flies = flight[-1][0] - flight[0][0] + 10_000, max(boots) - min(boots) + PAUSE
    for copy in range(copies):
        for time_usec, message in flight:
            if copy and hasattr(message, "time_boot_ms"):
                message.time_boot_ms += flies
            yield struct.pack(">Q", time_usec + copy * lasts) + make_frame(message, 1, 1, 0)


def main(copies: int) -> None:
    """Print the time to open the recording and to seek to places all over it."""
    reader = TlogReader(b"".join(repeated(copies)))
    began = time.perf_counter()
    feed = ReplayFeed(reader, "measured")
    opened = time.perf_counter() - began
    places = random.Random(SEED)  # noqa: S311 - no secret
    spent = []
    for _ in range(PLACES):
        place = places.random() * feed.timeline.duration
        began = time.process_time()
        feed.seek(place)
        spent.append(1e3 * (time.process_time() - began))
    spent.sort()
    median, worst = spent[PLACES // 2], spent[-1]
    print(f"{len(reader)} messages: opened in {opened:.1f} s")
    print(f"{PLACES} seeks, processor time: median {median:.1f} ms, worst {worst:.1f} ms")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 240)
