"""A real vehicle process under a flood: its telemetry, memory, processor time and state.

``python scripts/flood.py`` starts ``darko-sitl`` at real time, hovering in gusts, listens to it as its ground station,
and lets another process send hostile datagrams (``tests/support/links/flood.py``) in every second window, from 256
ports in turn and one in five from the ground station's own. Windows with and without flood alternate, so that other
load of the machine affects both alike. Ten minutes of flood take twenty; ``--minutes 1`` is a quick run.

The exit code is 1 if telemetry became slower by more than 10 %, or if parameters, plans, mode or arming changed.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import os
import re
import select
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.events import Event, MissionDownloaded, MissionUploaded, ParameterReceived, ParametersComplete
from protocol.plans import load
from protocol.wire.message import source_of
from tests.support.links.flood import VEHICLE, Flood
from tests.support.paths import DATA

FORK = multiprocessing.get_context("fork")
HOST = "127.0.0.1"
BURST_INTERVAL = 0.01  # between two bursts of the flood [s]
OWN_PORT_SHARE = 5  # one datagram in so many comes from the ground station's own port
STRANGERS = 256  # ports kept open, so that the vehicle's answers reach no other program
MAX_SLOWDOWN = 0.10  # share of telemetry that may be missing under the flood
SETTLING_TIME = 3.0  # of flight before the first window [s]
MIN_STREAMED = 10  # messages of a kind in a window that make it a streamed one
PLANS = {"mission": 0, "fence": 1, "rally": 2}


@dataclass
class Window:
    """Telemetry and cost of a stretch of time with or without the flood."""

    flooded: bool
    seconds: float = 0.0
    simulated: float = 0.0  # simulated time that passed [s]
    cpu: float = 0.0  # vehicle's processor time [s]
    off: float = 0.0  # maximum distance from the middle of the hover [m]
    counts: Counter[str] = field(default_factory=Counter)  # telemetry by message
    gaps: dict[str, float] = field(default_factory=lambda: defaultdict(float))  # longest wait for each [s]
    sent: Counter[str] = field(default_factory=Counter)  # hostile frames by kind; "datagrams"

    @property
    def rate(self) -> float:
        """Messages per second."""
        return self.counts.total() / self.seconds


class Listener:
    """A ground station without a screen that records everything it receives."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((HOST, 0))
        self.endpoint = GroundEndpoint()
        self.modes: set[tuple[int, bool]] = set()  # custom_mode and arming, from HEARTBEAT
        self.texts: list[str] = []
        self._peer: tuple[str, int] | None = None
        self._events: list[Event] = []
        self._parameters: dict[str, float] = {}
        self._last: dict[str, float] = {}

    def watch(self, vehicle: Vehicle, *, seconds: float, flooded: bool) -> Window:
        """Listen for a while."""
        window, began, cpu = Window(flooded), time.monotonic(), vehicle.cpu()
        self._last, boots, places = {}, [], []
        while time.monotonic() < began + seconds:
            for message, now in self._exchange():
                kind = message.get_type()
                window.counts[kind] += 1
                window.gaps[kind] = max(window.gaps[kind], now - self._last.get(kind, now))
                self._last[kind] = now
                if kind == "LOCAL_POSITION_NED":
                    boots.append(message.time_boot_ms / 1e3)
                    places.append((message.x, message.y, message.z))
        window.seconds, window.cpu = time.monotonic() - began, vehicle.cpu() - cpu
        window.simulated = boots[-1] - boots[0]
        middle = [statistics.median(axis) for axis in zip(*places, strict=True)]
        window.off = max(math.dist(place, middle) for place in places)
        return window

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._exchange()

    def state(self) -> dict[str, Any]:
        """Everything that a stranger might have changed, read from the vehicle."""
        now = time.monotonic()
        self._parameters = {}
        self.endpoint.request_parameters(now)
        self._wait_for(ParametersComplete)
        state: dict[str, Any] = {"parameters": dict(self._parameters)}
        for name, kind in PLANS.items():
            self.endpoint.download_mission(time.monotonic(), kind)
            state[name] = repr(self._wait_for(MissionDownloaded))  # as text, because NaN is not equal to itself
        return state

    def upload(self, plan: Path) -> None:
        """Upload a mission, which the flood might change."""
        self.endpoint.upload_mission(load(plan).items, now=time.monotonic())
        self._wait_for(MissionUploaded)

    def meet(self) -> None:
        """Wait for the vehicle's first message."""
        self._until(lambda: self.endpoint.vehicle == VEHICLE)

    def _wait_for(self, kind: type[Event]) -> Event:
        self._until(lambda: any(isinstance(event, kind) for event in self._events))
        found = next(event for event in self._events if isinstance(event, kind))
        self._events.clear()
        return found

    def _until(self, holds: Callable[[], bool], limit: float = 30.0) -> None:
        end = time.monotonic() + limit
        while not holds():
            if time.monotonic() > end:
                raise SystemExit(f"the vehicle did not answer within {limit:g} s; its last texts: {self.texts[-3:]}")
            self._exchange()

    def _exchange(self) -> list[tuple[Any, float]]:
        """Receive and send once; messages of the vehicle, each with its time."""
        heard = []
        if select.select([self.socket], [], [], 0.02)[0]:
            data, peer = self.socket.recvfrom(65535)
            now = time.monotonic()
            for message in self.endpoint.receive_datagram(data, now):
                if source_of(message) == VEHICLE:
                    self._peer = peer
                    self._note(message)
                    heard.append((message, now))
        self.endpoint.handle_timer(time.monotonic())
        for event in self.endpoint.events():
            self._events.append(event)
            if isinstance(event, ParameterReceived):
                self._parameters[event.name] = event.value
        for data in self.endpoint.datagrams_to_send():
            if self._peer is not None:
                self.socket.sendto(data, self._peer)
        return heard

    def _note(self, message: Any) -> None:  # noqa: ANN401 - generated messages are untyped
        if message.get_type() == "HEARTBEAT":
            self.modes.add((message.custom_mode, bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)))
        elif message.get_type() == "STATUSTEXT":
            self.texts.append(message.text)


class Vehicle:
    """A ``darko-sitl`` process that hovers in gusts."""

    def __init__(self, process: subprocess.Popen[str], port: int) -> None:
        self.process, self.port = process, port

    def cpu(self) -> float:
        """Processor time it has used [s]."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory(self) -> float:
        """Its resident memory [MB]."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@contextmanager
def flying(gcs_port: int, state: str, gusts: float, seed: int) -> Iterator[Vehicle]:
    """A vehicle in the air until the end of the block."""
    program = Path(sys.executable).with_name("darko-sitl")
    process = subprocess.Popen(  # noqa: S603 - our own program
        [str(program), "--port", "0", "--gcs-port", str(gcs_port), "--api-port", "0", "--state-dir", state,
         "--start", "0,0,5,0", "--gusts", str(gusts), "--seed", str(seed), "--param", "SIM_BAT_ENERGY=1e7"],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        for line in process.stderr or ():
            if ready := re.search(r"ready after .*?127\.0\.0\.1:(\d+)", line):
                yield Vehicle(process, int(ready[1]))
                return
        raise SystemExit("darko-sitl did not start")
    finally:
        process.terminate()
        process.wait()


def pour(listener: socket.socket, port: int, rate: float, seconds: float, seed: int, result: Any) -> None:  # noqa: ANN401
    """The hostile process: send for some seconds at a rate [datagrams/s], then return counts of what was sent."""
    strangers = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(STRANGERS)]
    for stranger in strangers:
        stranger.bind((HOST, 0))
    flood, sent, began = Flood(seed), 0, time.monotonic()
    while (elapsed := time.monotonic() - began) < seconds:
        while sent < elapsed * rate:
            datagram, sent = flood.datagram(), sent + 1
            sender = strangers[sent % STRANGERS] if sent % OWN_PORT_SHARE else listener
            sender.sendto(datagram, (HOST, port))
        time.sleep(BURST_INTERVAL)
    result.send(flood.counts | Counter(datagrams=sent))


def measure(listener: Listener, vehicle: Vehicle, args: argparse.Namespace) -> list[Window]:
    """Measure all windows, one after the other."""
    windows = []
    for number in range(2 * round(args.minutes * 60.0 / args.window)):
        flooded, (counts, result) = bool(number % 2), FORK.Pipe(duplex=False)
        seed = 1000 * args.seed + number
        hostile = FORK.Process(
            target=pour, args=(listener.socket, vehicle.port, args.rate, args.window, seed, result), daemon=True
        )
        if flooded:
            hostile.start()
        window = listener.watch(vehicle, seconds=args.window, flooded=flooded)
        if flooded:
            window.sent = counts.recv()
            hostile.join()
        windows.append(window)
        print(_line(number, window, vehicle), flush=True)
        listener.wait(0.5)  # drain what the flood left in the sockets
    return windows


def _line(number: int, w: Window, vehicle: Vehicle) -> str:
    kind = f"flood, {w.sent['datagrams'] / w.seconds:5.0f}/s" if w.flooded else "quiet         "
    return (
        f"{number:>4}  {kind}  {w.rate:7.1f} messages/s  {w.simulated / w.seconds:6.3f} times real time  "
        f"{100 * w.cpu / w.seconds:4.0f} % of a core  {vehicle.memory():6.1f} MB  {w.off:5.2f} m"
    )


def report(windows: list[Window]) -> float:
    """Print the figures; the share by which telemetry became slower."""
    quiet, flooded = ([w for w in windows if w.flooded is chosen] for chosen in (False, True))
    medians = [statistics.median(w.rate for w in some) for some in (quiet, flooded)]
    slower = 1.0 - medians[1] / medians[0]
    sent: Counter[str] = sum((w.sent for w in flooded), Counter())
    print(f"\nflood: {sent.pop('datagrams'):,} datagrams, {sent.total():,} frames: {dict(sent)}")
    print(f"telemetry: {medians[0]:.1f} messages/s without, {medians[1]:.1f} with: {100 * slower:+.2f} % slower")
    print(f"{'message':<28} {'per second':>20} {'longest wait [s]':>20}\n{'':<28} {'without':>10} {'with':>9}"
          f" {'without':>10} {'with':>9}")  # fmt: skip
    for kind in sorted(kind for kind, n in quiet[0].counts.items() if n >= MIN_STREAMED):
        rates = [statistics.median(w.counts[kind] / w.seconds for w in some) for some in (quiet, flooded)]
        gaps = [max(w.gaps[kind] for w in some) for some in (quiet, flooded)]
        print(f"{kind:<28} {rates[0]:>10.2f} {rates[1]:>9.2f} {gaps[0]:>10.3f} {gaps[1]:>9.3f}")
    for what, value in (
        ("processor [% of a core]", lambda w: 100 * w.cpu / w.seconds),
        ("off the middle of the hover [m]", lambda w: w.off),
    ):
        print(f"{what}: {max(map(value, quiet)):.2f} without, {max(map(value, flooded)):.2f} with, at most")
    return slower


def main() -> int:
    """Measure; exit code 1 if telemetry became too slow or something changed."""
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--minutes", type=float, default=10.0, help="duration of the flood, all windows together [10]")
    made.add_argument("--window", type=float, default=30.0, metavar="S", help="length of a window [30]")
    made.add_argument("--rate", type=float, default=1000.0, metavar="HZ", help="datagrams per second [1000]")
    made.add_argument("--gusts", type=float, default=1.0, metavar="RMS", help="the vehicle's gusts, m/s [1]")
    made.add_argument("--seed", type=int, default=7, help="seed of the flood and of the gusts [7]")
    args = made.parse_args()
    listener = Listener()
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        port = listener.socket.getsockname()[1]
        vehicle = stack.enter_context(flying(port, folder, args.gusts, args.seed))
        listener.meet()
        listener.upload(DATA / "square.plan")
        listener.wait(SETTLING_TIME)
        before, texts, memory = listener.state(), len(listener.texts), vehicle.memory()
        listener.modes.clear()
        print(f"seed {args.seed}, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores, memory {memory:.1f} MB")
        windows = measure(listener, vehicle, args)
        slower = report(windows)
        after = listener.state()
        print(f"memory: {memory:.1f} MB before, {vehicle.memory():.1f} MB after; load {os.getloadavg()[0]:.1f}")
        print(f"texts: {listener.texts[texts:]}")
        changed = [name for name in before if before[name] != after[name]]
        print(f"changed: {', '.join(changed) or 'no parameter, no plan'}; modes seen: {sorted(listener.modes)}")
    return int(slower > MAX_SLOWDOWN or bool(changed) or len(listener.modes) != 1)


if __name__ == "__main__":
    sys.exit(main())
