"""Messages to frames and back beside pymavlink, interleaved in one run: ``python scripts/bench/codec.py``.

The messages are those of a recorded flight, in its order and each kind for itself. Ours go the way of the product:
encoded for a link (``Codec.encode``), with and without being made from their fields first; decoded from a datagram
(``Codec.decode``), which also finds the frame, looks at its signature and counts losses. Pymavlink's, of the same
dialect, are packed (``pack``), and decoded from a frame whose bounds are known (``MAVLink.decode``); ``parse_buffer``
finds them, too. Pymavlink takes the checksum from fastcrc where that is installed, as here, or else computes it in
Python.

Times are the least of many short runs of processor time, and ratios those of the least: other work on the machine only
adds to them.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from build_dialect import DIALECT, load, pymavlink_module

from protocol.dialect import mavlink
from protocol.tlog import read_tlog
from protocol.wire.codec import Codec

FLIGHT = Path(__file__).resolve().parents[2] / "tests" / "data" / "square-flight.tlog"
FEWEST = 100  # of a kind, to have a row
ROUNDS = 500  # messages timed at once, at least
Peer = Any  # pymavlink's module of the dialect
Arguments = tuple[int, tuple[Any, ...]]  # a message's id, and what its class takes


class Messages(NamedTuple):
    """Messages to encode and to decode: of one kind, or all in the order of the flight."""

    name: str
    frames: list[bytes]
    fields: list[Arguments]

    def made(self, kinds: dict[int, Any]) -> list[Any]:
        """The messages by the classes of ours or of pymavlink."""
        return [kinds[number](*given) for number, given in self.fields]


def peers() -> list[Peer]:
    """Pymavlink's dialect, with fastcrc and without."""
    text = pymavlink_module(DIALECT / "darko.xml")
    return [load(text), load(text.replace("    import fastcrc\n", "    raise ImportError\n"))]


def read(path: Path) -> list[Messages]:
    """The messages of a log: all that the dialect has, then each kind that is frequent."""
    reader = read_tlog(path)
    every = [_fields(reader.decode(k)) for k, n in enumerate(reader.ids.tolist()) if n in mavlink.mavlink_map]
    kinds = {number: [given for given in every if given[0] == number] for number, _ in every}
    frequent = sorted((given for given in kinds.values() if len(given) >= FEWEST), key=len, reverse=True)
    named = [_messages(mavlink.mavlink_map[given[0][0]].msgname, given) for given in frequent]
    return [_messages("all, in their order", every), *named]


def _fields(message: Any) -> Arguments:  # noqa: ANN401 - of generated code
    names = message.get_fieldnames()
    return message.get_msgId(), tuple(getattr(message, f"_{name}_raw", getattr(message, name)) for name in names)


def _messages(name: str, fields: list[Arguments]) -> Messages:
    sender = Codec(1, 1)
    return Messages(name, [sender.encode(mavlink.mavlink_map[number](*given)) for number, given in fields], fields)


Work = Callable[[], object]


def works(messages: Messages) -> dict[str, Work]:
    """Ours, to be timed: each takes all the messages once."""
    sender, receiver, kinds = Codec(1, 1), Codec(255, 190), mavlink.mavlink_map
    made = messages.made(kinds)
    return {
        "encode": lambda: _exhaust(sender.encode(message) for message in made),
        "make": lambda: _exhaust(sender.encode(kinds[number](*given)) for number, given in messages.fields),
        "decode": lambda: _exhaust(receiver.decode(frame) for frame in messages.frames),
    }


def peer_works(messages: Messages, peer: Peer) -> dict[str, Work]:
    """The same of pymavlink's."""
    mav, kinds = peer.MAVLink(None, 1, 1), peer.mavlink_map
    made = messages.made(kinds)
    return {
        "encode": lambda: _exhaust(message.pack(mav) for message in made),
        "make": lambda: _exhaust(kinds[number](*given).pack(mav) for number, given in messages.fields),
        "decode": lambda: _exhaust(mav.decode(bytearray(frame)) for frame in messages.frames),
        "parse": lambda: _exhaust(mav.parse_buffer(frame) for frame in messages.frames),
    }


def _exhaust(results: Iterable[object]) -> None:
    deque(results, maxlen=0)


def least_times(timed: list[dict[str, Work]], count: int, runs: int) -> list[dict[str, float]]:
    """Processor time [us] of one of ``count`` messages by each work, the least of some runs."""
    repeat = -(-ROUNDS // count)
    least = [dict.fromkeys(named, float("inf")) for named in timed]
    for _ in range(runs):
        for named, times in zip(timed, least, strict=True):
            for name, work in named.items():
                began = time.process_time()
                for _ in range(repeat):
                    work()
                times[name] = min(times[name], 1e6 * (time.process_time() - began) / repeat / count)
    return least


def row(messages: Messages, others: list[Peer], runs: int) -> str:
    """One line of the table."""
    timed = [works(messages), *(peer_works(messages, peer) for peer in others)]
    ours, *theirs = least_times(timed, len(messages.frames), runs)
    cells = [f"{messages.name:<28}{len(messages.frames):>7}"]
    for name in ("encode", "make", "decode"):
        cells += [f"{ours[name]:7.2f}", *(f"{times[name] / ours[name]:6.1f}" for times in theirs)]
    return " ".join([*cells, *(f"{times['parse'] / ours['decode']:6.1f}" for times in theirs)])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--log", type=Path, default=FLIGHT, help="a telemetry log [the square of the tests]")
    parser.add_argument("--runs", type=int, default=60)
    args = parser.parse_args()
    print("message, number; encoded, made and encoded, decoded: us, times as fast as pymavlink with fastcrc, without;")
    print("decoded beside parse_buffer: times as fast as with fastcrc, without")
    others = peers()
    for messages in read(args.log):
        print(row(messages, others, args.runs), flush=True)


if __name__ == "__main__":
    main()
