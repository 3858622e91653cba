"""Real processes killed with SIGKILL and restarted: a vehicle in flight, a ground station that watches it."""

import json
import os
import re
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from protocol.plans import load
from protocol.tlog import read_tlog
from tests.e2e.support import BIN, BRISK, free_ports
from tests.e2e.watch import fingerprint
from tests.support.paths import DATA

LIMIT = 60.0  # of every wait [s]
WATCH = Path(__file__).with_name("watch.py")
KEY = bytes(range(32)).hex()


class Process:
    """A child process that is killed at the end, if not before."""

    def __init__(self, *command, **pipes):
        self.process = subprocess.Popen(command, **pipes)

    def kill(self):
        """End it like a crash."""
        if self.process.poll() is None:
            os.kill(self.process.pid, signal.SIGKILL)
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
            if stream is not None:
                stream.close()


class Vehicle(Process):
    """``darko-sitl`` that navigates by the truth, ready to fly at once."""

    def __init__(self, port, folder, *arguments):
        super().__init__(
            str(BIN / "darko-sitl"), "--port", "0", "--gcs-port", str(port), "--api-port", "0", "--nav", "truth",
            "--state-dir", str(folder), *arguments, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        printed = []
        for line in self.process.stderr:
            printed.append(line)
            if re.search("ready after", line):
                return
        raise AssertionError("".join(printed))


class Station(Process):
    """The ground station without a screen, and the state it shows."""

    def __init__(self, port, folder, *key):
        command = (sys.executable, str(WATCH), str(port), str(folder), *key)
        super().__init__(*command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.shown, self._rest = {}, b""

    def ask(self, request):
        """Send one of the operator's requests."""
        self.process.stdin.write(f"{request}\n".encode())
        self.process.stdin.flush()

    def until(self, holds):
        """The shown state, as soon as a condition holds."""
        end = time.monotonic() + LIMIT
        while True:
            for line in self._lines(end):
                self.shown = json.loads(line)
                if holds(self.shown):
                    return self.shown

    def _lines(self, end):
        assert select.select([self.process.stdout], [], [], max(0.0, end - time.monotonic()))[0], json.dumps(self.shown)
        data = os.read(self.process.stdout.fileno(), 1 << 16)
        assert data, f"the ground station ended, having shown {self.shown}"
        *lines, self._rest = (self._rest + data).split(b"\n")
        return lines


@pytest.fixture
def start(tmp_path):
    """Start a process on the test's port and in its folder; all end with the test."""
    (port,) = free_ports(1)
    running = []

    def start_process(kind, *arguments):
        running.append(kind(port, tmp_path / kind.__name__, *arguments))
        return running[-1]

    yield start_process
    for process in running:
        process.kill()


def items_of(path):
    return fingerprint(load(path).items)


def has(items):
    """A condition: a mission is shown and no transfer is running."""
    return lambda s: s["mission"] == items and s["transfer"] is None


def is_synchronised(shown):
    """A condition: plans, parameters and home have arrived."""
    return shown["has_parameters"] and shown["transfer"] is None and shown["home"]


def restarts_in(log):
    """Number of steps back of the vehicle's time since boot in a recording that may still grow."""
    boots = read_tlog(log).columns("ATTITUDE")["time_boot_ms"].astype(int)
    return (boots[1:] < boots[:-1] - 1000).sum()


SQUARE = DATA / "square.plan"


def waypoints(path, count, apart):
    """A QGC WPL 110 file: home, take-off, and northwards in steps [1e-7 deg]."""
    places = (
        f"{22 if n == 1 else 16}\t0\t0\t0\t0\t{43.5648 + n * apart * 1e-7:.7f}\t1.4811\t5\t1" for n in range(count + 1)
    )
    rows = (f"{n}\t0\t3\t{place}" for n, place in enumerate(places))
    path.write_text("\n".join(("QGC WPL 110", *rows)) + "\n")
    return path


@pytest.mark.long
def test_a_mission_goes_on_after_either_side_is_killed(start, tmp_path):
    plan = waypoints(tmp_path / "long.waypoints", 24, 2700)
    items = items_of(plan)
    vehicle, first = start(Vehicle, "--speed", "5", *BRISK), start(Station)
    first.until(is_synchronised)
    first.ask(f"plans.upload {plan}")
    first.until(has(items))
    first.until(lambda s: s["ready"])
    first.ask("arm")
    first.until(lambda s: s["armed"])
    first.ask("plans.start_mission")
    first.until(lambda s: s["mode"] == "MISSION" and s["current"] == 2)
    first.kill()

    second = start(Station)
    shown = second.until(is_synchronised)
    assert shown["mission"] == items
    assert (shown["mode"], shown["armed"]) == ("MISSION", True)
    assert shown["current"] >= 2
    second.until(lambda s: s["current"] > shown["current"] and s["reached"])
    assert shown["log"] != first.shown["log"]
    log = read_tlog(first.shown["log"])
    assert len(log.rows("MISSION_ITEM_INT")) == 24
    assert sum(piece.length for piece in log.damage) < 300  # at most one record, cut short

    vehicle.kill()
    second.until(lambda s: s["lost"])
    start(Vehicle)
    shown = second.until(lambda s: s["restarts"] == 1 and is_synchronised(s))
    assert shown["mission"] == items
    assert (shown["lost"], shown["armed"], shown["reached"]) == (False, False, [])
    second.until(lambda s: restarts_in(s["log"]) == 1)  # before and after the restart, in one log


@pytest.mark.long
def test_a_signed_upload_cut_short_on_either_side_leaves_one_whole_plan_and_the_next_succeeds(start, tmp_path):
    long = waypoints(tmp_path / "long.waypoints", 150, 10)
    plans = [items_of(SQUARE), items_of(long)]
    standing = ("--signing-key", KEY, "--speed", "2")  # a transfer does not wait for simulated time
    vehicle, station = start(Vehicle, *standing), start(Station, KEY)
    assert station.until(is_synchronised)["signing"] == "SIGNED"
    station.ask(f"plans.upload {SQUARE}")
    station.until(lambda s: "Mission of 6 items uploaded" in s["texts"])
    station.ask(f"plans.upload {long}")
    station.until(lambda s: s["transfer"] is not None and s["transfer"][1] > 20)
    station.kill()

    station = start(Station, KEY)
    assert station.until(is_synchronised)["mission"] in plans
    station.ask(f"plans.upload {SQUARE}")
    station.until(lambda s: "Mission of 6 items uploaded" in s["texts"])
    station.ask(f"plans.upload {long}")
    station.until(lambda s: s["transfer"] is not None and s["transfer"][1] > 20)
    vehicle.kill()

    start(Vehicle, *standing)
    assert station.until(lambda s: s["restarts"] == 1 and is_synchronised(s))["mission"] in plans
    assert any(text.startswith("Mission upload failed") for text in station.shown["texts"])
    station.ask(f"plans.upload {long}")
    assert station.until(lambda s: "Mission of 150 items uploaded" in s["texts"])["mission"] == plans[1]
