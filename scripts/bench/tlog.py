"""Messages a second of the log reader, beside the generated codec's own parse loop, interleaved in one run.

Usage: python scripts/bench/tlog.py FILE.tlog [--repeat N] [--runs N]

Three readers read the same bytes: the index alone (every checksum verified), the index and all fields as columns, and
the codec's ``parse_char`` fed as pymavlink feeds it. A damaged copy shows what each of them recovers.
"""

from __future__ import annotations

import argparse
import random
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from protocol.dialect import mavlink
from protocol.tlog import TlogReader, message_name
from protocol.tlog.time_stamp import STAMP_SIZE


def index(data: bytes) -> int:
    """Records found by the reader."""
    return len(TlogReader(data))


def columns(data: bytes) -> int:
    """Records found, every field of every message of the dialect decoded."""
    reader = TlogReader(data)
    for number in set(reader.ids[reader.known].tolist()):
        reader.columns(message_name(number))
    return len(reader)


def codec(data: bytes) -> int:
    """Messages of the dialect decoded by the generated codec: time, then bytes until a message comes, again."""
    mav = mavlink.MAVLink(None)
    mav.robust_parsing = True
    at, count = STAMP_SIZE, 0
    while at < len(data):
        needed = mav.bytes_needed()
        message = mav.parse_char(data[at : at + needed])
        at += needed
        if message is not None and message.get_type() != "BAD_DATA":
            count += not isinstance(message, mavlink.MAVLink_unknown)
            at += STAMP_SIZE
    return count


def damaged(data: bytes) -> bytes:
    """A copy with a hundred stretches of up to 300 bytes overwritten, removed or inserted."""
    chance = random.Random(1)  # noqa: S311 - the same damage every time, no secret
    copy = bytearray(data)
    for _ in range(100):
        at, length = chance.randrange(len(copy)), chance.randrange(1, 300)
        end = at + chance.choice((0, length))
        copy[at:end] = chance.randbytes(chance.choice((0, length)))
    return bytes(copy)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path)
    parser.add_argument("--repeat", type=int, default=10, help="repeat the file this many times [10]")
    parser.add_argument("--runs", type=int, default=5, help="interleaved runs of each reader [5]")
    args = parser.parse_args()
    data = args.file.read_bytes() * args.repeat
    records = len(TlogReader(data))
    print(f"{records:,} messages, {len(data):,} bytes; medians of {args.runs} interleaved runs")
    readers: dict[str, Callable[[bytes], int]] = {"index": index, "columns": columns, "codec loop": codec}
    spent: dict[str, list[float]] = {name: [] for name in readers}
    for _ in range(args.runs):
        for name, reader in readers.items():
            begin = time.perf_counter()
            reader(data)
            spent[name].append(time.perf_counter() - begin)
    rates = {name: records / statistics.median(times) for name, times in spent.items()}
    for name, rate in rates.items():
        print(f"{name:<10} {rate / 1e6:8.3f} M messages/s  {rate / rates['codec loop']:7.1f} x the codec loop")
    copy = damaged(args.file.read_bytes())
    found = TlogReader(copy)
    lost = sum(piece.length for piece in found.damage)
    print(
        f"damaged copy, messages of the dialect recovered: reader {int(found.known.sum()):,} "
        f"({lost:,} bytes skipped in {len(found.damage)} places), codec loop {codec(copy):,}"
    )


if __name__ == "__main__":
    main()
