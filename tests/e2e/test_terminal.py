"""The ground station in a terminal: a mission from an empty screen to the landing, then its replay."""

import fcntl
import os
import pty
import select
import struct
import subprocess
import sys
import termios
import time
from contextlib import contextmanager, suppress

import pyte
import pytest

from darko_gcs.tui.key_footer import BURST_GAP
from protocol.dialect import mavlink
from protocol.tlog import read_tlog
from tests.e2e.support import brisk
from tests.support.paths import DATA

DEADLINE = 90.0  # for a step of the flight on a machine that has much else to do [s]
COMPILED = 600.0  # for the vehicle's first start there [s]
ROWS, COLUMNS = 40, 120
PIECES = 16  # of a few kB that are read before the next look at the screen


class Terminal:
    """A program in a terminal, and what stands on its screen."""

    def __init__(self, fd):
        self.fd = fd
        self._screen = pyte.Screen(COLUMNS, ROWS)
        self._stream = pyte.ByteStream(self._screen)

    def until(self, words, deadline=DEADLINE):
        """Wait until these words stand on the screen."""
        end = time.monotonic() + deadline
        while words not in (text := "\n".join(self._screen.display)):
            assert time.monotonic() < end, f"{words} not in\n{text}"
            self._read(0.1)

    def _read(self, wait):
        """Take what the program has drawn; to look at the screen after every piece would cost more than to draw it."""
        pieces = 0
        while pieces < PIECES and select.select([self.fd], [], [], 0.0 if pieces else wait)[0]:
            try:
                self._stream.feed(os.read(self.fd, 1 << 12))
            except OSError:  # the program has ended
                time.sleep(wait)
                return
            pieces += 1

    def press(self, keys, words):
        """Press keys, and wait for what they bring onto the screen."""
        self._write(keys)
        self.until(words)

    def _write(self, keys):
        """Press keys as soon as a finger could: a fast machine has answered the ones before in less."""
        time.sleep(2 * BURST_GAP)
        os.write(self.fd, keys.encode())

    def quits(self, process):
        """Quit, and read until the program has ended; its exit code."""
        self._write("q")
        end = time.monotonic() + DEADLINE
        while process.poll() is None and time.monotonic() < end:
            self._read(0.1)
        return process.poll()


@contextmanager
def station(folder, *arguments):
    """``darko-gcs`` in a terminal of its own."""
    outside, inside = pty.openpty()
    fcntl.ioctl(inside, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, COLUMNS, 0, 0))
    own = {name: str(folder) for name in ("XDG_STATE_HOME", "XDG_DATA_HOME", "XDG_CONFIG_HOME")}
    process = subprocess.Popen(
        [sys.executable, "-m", "darko_gcs", *arguments],
        stdin=inside, stdout=inside, stderr=inside, start_new_session=True,
        env=os.environ | own | {"TERM": "xterm-256color"},
    )  # fmt: skip
    os.close(inside)
    try:
        yield Terminal(outside), process
    finally:
        with suppress(OSError):
            os.close(outside)  # or it would wait for somebody to read what it draws
        process.terminate()
        process.wait(timeout=DEADLINE)


@pytest.mark.long
def test_a_terminal_that_goes_without_a_signal_ends_the_ground_station(tmp_path):
    with station(tmp_path, "--port", "0", "--record", str(tmp_path / "logs")) as (terminal, process):
        terminal.until("Takeoff")
        os.close(terminal.fd)
        assert process.wait(timeout=DEADLINE) == 0
    assert list((tmp_path / "logs").iterdir()) == []


@pytest.mark.long
def test_a_mission_is_flown_from_an_empty_screen_to_the_landing_and_replayed(tmp_path):
    plan, logs = str(DATA / "square.plan"), tmp_path / "logs"
    simulator = ("--sitl", "--speed", "10", *brisk(tmp_path / "sitl"))
    with station(tmp_path, *simulator, "--record", str(logs), "--mission", plan) as (terminal, process):
        terminal.until("Navigation: aligned", COMPILED)
        terminal.press("m", "square.plan: 6 items")
        terminal.press("u", "read back as sent")
        terminal.press("\x1b", "Messages")
        terminal.press("a", "propellers")
        terminal.press("y", "ARMED")
        terminal.press("s", "Fly the mission")
        terminal.press("y", "Landed")  # what is shown on the way may be gone before a slow machine has drawn it
        terminal.until("disarmed")
        assert terminal.quits(process) == 0
    (log,) = logs.glob("*.tlog")
    recording = read_tlog(log)
    assert set(range(1, 6)) <= set(recording.columns("MISSION_CURRENT")["seq"])
    states = recording.columns("EXTENDED_SYS_STATE")["landed_state"]
    assert states[0] == states[-1] == mavlink.MAV_LANDED_STATE_ON_GROUND
    assert mavlink.MAV_LANDED_STATE_IN_AIR in states
    with station(tmp_path, "replay", str(log)) as (terminal, process):
        terminal.until("REPLAY")
        terminal.press(" ", "⏸")
        terminal.press("\x1b[F", "on ground")  # End
        terminal.press("J", "INDI")  # the law before the last jump
        assert terminal.quits(process) == 0
