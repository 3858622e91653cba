"""Runs any bytes as a session with one end of the link, and searches for sessions that reach new code.

An input is a small program. Its first byte chooses the end, the vehicle's or the ground station's. Each further step
delivers a well-formed message, delivers raw bytes, lets time pass, or makes the owner request something. For every
input, no step may raise an error, every answer must be readable, and the answers must come to an end.
"""

import math
import random
import sys
from collections.abc import Callable, Hashable
from contextlib import suppress
from pathlib import Path

from pymavlink.generator.mavcrc import x25crc

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.engines.file_transfer import BytesFile, Entry, Log
from protocol.errors import LocalProtocolError
from protocol.events import CommandRequested, RemoteLog
from protocol.plans.plan import Refusal
from protocol.wire.codec import Codec
from tests.support.links.link import plan, table
from tests.support.paths import DATA

CORPUS = DATA / "fuzz_corpus.txt"
MAX_STEPS = 60  # of one input
MAX_INPUT = 1500  # [bytes]
MAX_ANSWERS = 2000  # to one step
MESSAGE, RAW, WAIT = 96, 112, 176  # limits of the step codes; higher ones are requests of the owner
SENDERS = ((255, 190), (1, 1), (245, 190), (0, 0), (1, 100), (1, 191), (255, 0), (7, 3))
ELSEWHERE, STRANGER = 32, 64  # bits of a message's step code: for another component; from a third port
PROTOCOL = str(Path(mavlink.__file__).parents[1])

TAKEN = sorted(set(VehicleEndpoint(validate=lambda _items: None)._server_of) | {
    "HEARTBEAT", "SETUP_SIGNING", "MANUAL_CONTROL", "SET_POSITION_TARGET_LOCAL_NED", "REQUEST_DATA_STREAM",
    "COMMAND_ACK", "MISSION_ACK", "MISSION_COUNT", "MISSION_CURRENT", "MISSION_ITEM_INT", "MISSION_REQUEST_INT",
    "PARAM_VALUE", "PARAM_ERROR", "LOG_ENTRY", "LOG_DATA", "STATUSTEXT", "PING", "TIMESYNC",
})  # fmt: skip
IDS = [number for number, known in sorted(mavlink.mavlink_map.items()) if known.msgname in TAKEN]
INTERESTING = (0, 1, 2, 3, 4, 5, 16, 22, 127, 128, 129, 190, 254, 255)
WORDS = (b"\0\0\xc0\x7f", b"\0\0\x80\x7f", b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"K_0\0", b"/a\0", b"\0\0\x80\x3f")


class _Files:
    """A few files and logs, in memory."""

    def entries(self, path: str):
        if path.strip("/"):
            raise FileNotFoundError(2, "none")
        return [Entry("a", 700), Entry("b", None)]

    def logs(self):
        return [Log("a", 0, 700), Log("b", 1, 0)]

    def open(self, name: str):
        if "a" not in name:
            raise FileNotFoundError(2, "none")
        return BytesFile(bytes(range(100)) * 7)


class _Program:
    def __init__(self, data: bytes) -> None:
        self._data, self._at = data[:MAX_INPUT], 0

    @property
    def is_over(self) -> bool:
        return self._at >= len(self._data)

    def take(self, size: int) -> bytes:
        part = self._data[self._at : self._at + size]
        self._at += size
        return part.ljust(size, b"\0")

    def byte(self) -> int:
        return self.take(1)[0]


class _VehicleEnd:
    def __init__(self) -> None:
        files = _Files()
        others = {kind: (plan(2), self._check) for kind in (1, 2)}
        self.endpoint = VehicleEndpoint(
            commands=(16, 22, 400), parameters=table(), mission=plan(3), validate=self._check, plans=others,
            streams={30: 20_000}, on_request=(242,), peers=["a", "b"], files=files, logs=files,
        )  # fmt: skip
        self._port, self._sent = "", b""

    @staticmethod
    def _check(items):
        return Refusal("too long", 1) if len(items) > 5 else None

    def receive(self, data: bytes, key: int, now: float) -> None:
        self._port, self._sent = "c" if key & STRANGER else "ab"[key & 1], data
        self.endpoint.receive_datagram(data, self._port, now)

    def act(self, op: int, _program: _Program, _now: float) -> None:
        self.endpoint.set_parameter("K_1", float(op % 7))

    def settle(self, now: float) -> list[bytes]:
        for event in self.endpoint.events():
            if isinstance(event, CommandRequested):
                self.endpoint.acknowledge(event.request, 5 if event.param(1) == 1.0 else 0, now)
        self.endpoint.streams_due(round(now * 1e6))
        self.endpoint.handle_timer(now)
        assert not math.isnan(self.endpoint.next_deadline())
        datagrams = self.endpoint.datagrams_to_send()
        assert all(_source(data) == (1, 1) or self._may_be_forwarded(data, to) for to, data in datagrams)
        return [data for _, data in datagrams]

    def _may_be_forwarded(self, data: bytes, to: Hashable) -> bool:
        return data in self._sent and to != self._port


class _GroundEnd:
    def __init__(self) -> None:
        self.endpoint = GroundEndpoint()
        alive = mavlink.MAVLink_heartbeat_message(19, 12, 0, 0, 4, 3)
        self.endpoint.receive_datagram(Codec(1, 1).encode(alive), 0.0)

    def receive(self, data: bytes, _key: int, now: float) -> None:
        self.endpoint.receive_datagram(data, now)

    def act(self, op: int, program: _Program, now: float) -> None:
        ground, kind = self.endpoint, program.byte() % 3
        calls: tuple[Callable[[], object], ...] = (
            lambda: ground.upload_mission(plan(op % 4), now=now, kind=kind),
            lambda: ground.download_mission(now, kind),
            lambda: ground.clear_mission(now, kind),
            lambda: ground.set_current_mission_item(kind, now),
            lambda: ground.give_up_requests("stop"),
            lambda: ground.request_parameters(now),
            lambda: ground.set_parameter("K_0", 1.0, now),
            lambda: ground.command(22, now=now),
            lambda: ground.read_file("/", now),
            lambda: ground.read_file("/a", now),
            lambda: ground.read_file("/b", now),
            lambda: ground.list_logs(now),
            lambda: ground.fetch_log(RemoteLog(0, 0, 700), now),
        )
        with suppress(LocalProtocolError):  # requests out of turn are refused
            calls[op % len(calls)]()

    def settle(self, now: float) -> list[bytes]:
        self.endpoint.events()
        self.endpoint.handle_timer(now)
        assert not math.isnan(self.endpoint.next_deadline())
        return self.endpoint.datagrams_to_send()


def run(data: bytes) -> None:
    """Run one input; raises any error that the code under test raises."""
    program = _Program(data)
    end = _GroundEnd() if program.byte() & 1 else _VehicleEnd()
    listener, now = Codec(9, 9), 0.0
    for sequence in range(MAX_STEPS):
        if program.is_over:
            return
        op = program.byte()
        if op < MESSAGE:
            end.receive(_frame(program, op, sequence), op, now)
        elif op < RAW:
            end.receive(program.take(program.byte()), op, now)
        elif op < WAIT:
            now += (op - RAW) ** 2 / 400.0
        else:
            end.act(op, program, now)
        answers = end.settle(now)
        assert len(answers) <= MAX_ANSWERS, "answers without end"
        assert all(len(listener.decode(answer)) == 1 for answer in answers), "an unreadable answer"


def _frame(program: _Program, op: int, sequence: int) -> bytes:
    """A version 2 frame with a right checksum: payload from the program, target according to ``op``."""
    known = mavlink.mavlink_map.get(int.from_bytes(program.take(2), "little"))
    if known is None:
        return b""
    size = known.unpacker.size
    payload = bytearray(program.take(min(program.byte(), size)).ljust(size, b"\0"))
    if op & 2:  # to every component, or to another one
        target = SENDERS[(op >> 2) + 4 & 7] if op & ELSEWHERE else (0, 0)
        fixed = dict(zip(("target_system", "target_component"), target, strict=True))
        values, names = list(known.unpacker.unpack(payload)), known.ordered_fieldnames
        if len(values) == len(names):  # no arrays among them
            values = [fixed.get(name, value) for name, value in zip(names, values, strict=True)]
            payload = bytearray(known.unpacker.pack(*values))
    source = SENDERS[op >> 2 & 7]
    head: bytes = bytes([0xFD, len(payload), 0, 0, sequence, *source]) + known.id.to_bytes(3, "little")
    crc: int = x25crc(head[1:] + payload + bytes([known.crc_extra])).crc
    return head + bytes(payload) + crc.to_bytes(2, "little")


def _source(frame: bytes) -> tuple[int, int]:
    at = 5 if frame[0] == 0xFD else 3
    return frame[at], frame[at + 1]


# The search


def covered(data: bytes) -> set[tuple[str, int, int]]:
    """The line-to-line jumps in ``protocol`` (without the generated dialect) that an input causes."""
    arcs: set[tuple[str, int, int]] = set()

    def watch(frame, _event, _argument):
        name = frame.f_code.co_filename
        if not name.startswith(PROTOCOL) or name.endswith("mavlink.py"):
            return None
        last = -frame.f_code.co_firstlineno

        def line(frame, event, _argument):
            nonlocal last
            if event == "line":
                arcs.add((name, last, frame.f_lineno))
                last = frame.f_lineno
            return line

        return line

    before = sys.gettrace()
    sys.settrace(watch)
    try:
        run(data)
    finally:
        sys.settrace(before)
    return arcs


def fresh(draw: random.Random) -> bytes:
    """A new input of a few steps."""
    return bytes([draw.randrange(2)]) + b"".join(_step(draw) for _ in range(draw.randint(1, 12)))


def _step(draw: random.Random) -> bytes:
    choice = draw.random()
    if choice < 0.65:
        return bytes([draw.randrange(MESSAGE) | 2]) + draw.choice(IDS).to_bytes(2, "little") + _payload(draw)
    if choice < 0.7:
        size = draw.randrange(40)
        return bytes([draw.randrange(MESSAGE, RAW), size]) + draw.randbytes(size)
    return bytes([draw.randrange(RAW, 256), draw.choice(INTERESTING)][: 1 + (choice > 0.85)])


def _payload(draw: random.Random) -> bytes:
    body = bytearray(draw.choice((4, 12, 32, 60, 255)))
    for _ in range(draw.randrange(8)):
        body[draw.randrange(len(body))] = draw.choice(INTERESTING)
    if draw.random() < 0.4:
        at, word = draw.randrange(len(body)), draw.choice(WORDS)
        body[at : at + len(word)] = word
    return bytes([len(body) & 255]) + bytes(body)


def mutated(draw: random.Random, corpus: list[bytes]) -> bytes:
    """A mutation of a stored input."""
    data = bytearray(draw.choice(corpus))
    for _ in range(draw.randint(1, 4)):
        at = draw.randrange(len(data) + 1)
        way = draw.randrange(5)
        if way == 0:
            data[at:at] = _step(draw)
        elif way == 1 and at < len(data):
            data[at] = draw.choice(INTERESTING)
        elif way == 2 and at < len(data):
            data[at] ^= 1 << draw.randrange(8)
        elif way == 3:
            del data[at : at + draw.randint(1, 20)]
        else:
            data += draw.choice(corpus)[1:]
    return bytes(data[:MAX_INPUT]) or b"\0"


def read_corpus() -> list[bytes]:
    """The stored inputs, shortest first."""
    lines = CORPUS.read_text(encoding="ascii").split() if CORPUS.exists() else []
    return [bytes.fromhex(line) for line in lines]


def write_corpus(inputs: list[bytes]) -> None:
    """Store these inputs."""
    CORPUS.write_text("".join(f"{data.hex()}\n" for data in sorted(inputs, key=lambda d: (len(d), d))), "ascii")
