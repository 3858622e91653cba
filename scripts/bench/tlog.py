"""Messages a second of the log reader beside pymavlink's and fasttlogparser's, interleaved in one run.

Usage: python scripts/bench/tlog.py FILE.tlog [--repeat N] [--runs N]

Every reader reads the same file from the disk, verifies every checksum, and decodes the same fields: of every message,
or of two messages alone. Figures are medians of processor time. The peers:

- pymavlink's ``mavlink_connection(FILE)`` and ``recv_match`` until nothing comes, as its users have it, with the
  dialect ``all`` and with fastcrc; a message's fields are its attributes then;
- fasttlogparser, if it is installed (pip install scikit-build-core 'pybind11<3' cmake, then with --no-build-isolation
  fasttlogparser): compiled, fields as arrays. It knows no DARKO_* and prints a line for each, which costs it time: a
  log of another autopilot is the fair one.

For two messages alone, pymavlink skips the others by their headers and verifies none of them.

A damaged copy shows what each of them recovers.
"""

from __future__ import annotations

import argparse
import io
import random
import statistics
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from pymavlink import mavutil

from protocol.tlog import TlogReader, read_tlog

TWO_MESSAGES = ["ATTITUDE", "GLOBAL_POSITION_INT"]
Load = Callable[[str, list[str] | None], int]  # file, messages (None: all) -> messages decoded


def ours(path: str, names: list[str] | None) -> int:
    """Messages whose fields were decoded by the project's reader."""
    reader = read_tlog(path)
    return sum(len(next(iter(reader.columns(name).values()), ())) for name in names or reader.names)


def pymavlink(path: str, names: list[str] | None) -> int:
    """The same by pymavlink's reader."""
    log = mavutil.mavlink_connection(path, dialect="all")
    count = 0
    while (message := log.recv_match(type=names)) is not None:
        count += message.get_type() != "BAD_DATA" and not message.get_type().startswith("UNKNOWN")
    log.close()
    return count


def fasttlogparser() -> Load | None:
    """The same by fasttlogparser; None if it is not installed."""
    try:
        import fasttlogparser as parser  # noqa: PLC0415 - an option
    except ImportError:
        return None

    def load(path: str, names: list[str] | None) -> int:
        with redirect_stdout(io.StringIO()):
            messages: dict[str, dict[str, Any]] = parser.parseTLog(path, whitelist=names or [])[0]
        return sum(len(fields["timestamp"]) for fields in messages.values())

    return load


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
    readers = {"ours": ours, "pymavlink": pymavlink, "fasttlogparser": fasttlogparser()}
    loads = {name: load for name, load in readers.items() if load is not None}
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "bench.tlog")
        data = args.file.read_bytes()
        Path(path).write_bytes(data * args.repeat)
        print(f"{len(TlogReader(data)) * args.repeat:,} messages, {len(data) * args.repeat:,} bytes, {args.runs} runs")
        for what, names in (("all fields", None), (f"{', '.join(TWO_MESSAGES)} alone", TWO_MESSAGES)):
            compare(what, loads, path, names, args.runs)
        print_memory(path)
        Path(path).write_bytes(damaged(data))
        found = ", ".join(f"{name} {load(path, None):,}" for name, load in loads.items())
        print(f"damaged copy, messages recovered: {found}")


def compare(what: str, loads: dict[str, Load], path: str, names: list[str] | None, runs: int) -> None:
    """Time the readers in turns and print their rates over all messages of the file."""
    spent: dict[str, list[float]] = {name: [] for name in loads}
    counts: dict[str, int] = {}
    for _ in range(runs):
        for name, load in loads.items():
            begin = time.process_time()
            counts[name] = load(path, names)
            spent[name].append(time.process_time() - begin)
    records = len(read_tlog(path))
    rates = {name: records / statistics.median(times) for name, times in spent.items()}
    print(what)
    for name, rate in rates.items():
        ratio = f"ours is {rates['ours'] / rate:.1f} x as fast" if name != "ours" else ""
        print(f"  {name:<15} {rate / 1e6:7.3f} M messages/s, {counts[name]:,} decoded  {ratio}")


def print_memory(path: str) -> None:
    """Print the memory of the index, and of columns, for each message."""
    tracemalloc.start()
    reader = read_tlog(path)
    index, peak = (value - reader.size for value in tracemalloc.get_traced_memory())
    reader.rows("ATTITUDE")  # groups the records by message, once
    before = tracemalloc.get_traced_memory()[0]
    roll = reader.columns("ATTITUDE")["roll"]
    column = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    per_message = f"{index / len(reader):.0f} bytes a message ({peak / len(reader):.0f} while it is made)"
    print(f"memory beside the file's bytes: index {per_message}, one column of {len(roll):,} messages {column:,} bytes")


if __name__ == "__main__":
    main()
