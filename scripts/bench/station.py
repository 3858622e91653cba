"""The ground station's share of a core, and its time to the first frame: ``python scripts/bench/station.py``.

It runs in a pseudo-terminal, beside a vehicle that it sends into forward flight, in gusts, and that sends all its
telemetry. Processor time counts, so other work on the machine hardly matters; the time to the first frame is the best
of some starts, whose files the system has in memory from the second on.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import pty
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import termios
import time
from pathlib import Path

from darko_gcs.state.chart_views import ChartView, ChartViews

ROOT = Path(__file__).resolve().parents[2]
FIRST_FRAME = b"waiting for a vehicle"
FIRST_FRAME_LIMIT = 120.0  # on a machine that does much else [s]
COMPILED = 300.0  # within which the vehicle is ready [s]
STARTS = 5
TICKS = os.sysconf("SC_CLK_TCK")
FLIGHT = ("--start", "0,0,30,0", "--wind", "4@270", "--gusts", "1")
SETTLED = 12.0  # after the beginning of the transition [s]
CHARTED = {  # 50 curves in five charts, of messages at 10 or 20 Hz
    "ATTITUDE": "roll pitch yaw rollspeed pitchspeed yawspeed",
    "LOCAL_POSITION_NED": "x y z vx vy vz",
    "ATTITUDE_QUATERNION": "q1 q2 q3 q4 rollspeed pitchspeed yawspeed",
    "HIGHRES_IMU": "xacc yacc zacc xgyro ygyro zgyro",
    "DARKO_HYBRID_STATE": "v_hover v_forward v_attitude v_hover_enter governor law jumps",
    "DARKO_ACTUATORS": "motor_speed[0] motor_speed[1] motor_command[0] motor_command[1] thrust[0] thrust[1] elevon[0] "
    "elevon[1] elevon_command[0] elevon_command[1]",
}
COMBINED = (  # of two messages, or of two fields
    "hypot(LOCAL_POSITION_NED.vx, LOCAL_POSITION_NED.vy)", "deg(ATTITUDE.pitch)", "deg(DARKO_ACTUATORS.elevon[0])",
    "ATTITUDE.roll - ATTITUDE_QUATERNION.q1", "hypot(HIGHRES_IMU.xacc, HIGHRES_IMU.zacc)", "LOCAL_POSITION_NED.z * -1",
    "DARKO_ACTUATORS.thrust[0] + DARKO_ACTUATORS.thrust[1]", "log10(DARKO_HYBRID_STATE.v_hover)",
)  # fmt: skip
CHART_KEYS = (b"C", b"o", b"\r")  # opens the charts, and the view that was saved


class Terminal:
    """``darko-gcs`` in a pseudo-terminal.

    Args:
        size: Columns and rows.
        folder: Where it keeps its files.
        arguments: Of ``darko-gcs``.
    """

    def __init__(self, size: tuple[int, int], folder: Path, *arguments: str) -> None:
        self.begun = time.perf_counter()
        self.screen = b""
        own = {name: str(folder) for name in ("XDG_STATE_HOME", "XDG_DATA_HOME", "XDG_CONFIG_HOME")}
        own |= {
            "PYTHONDONTWRITEBYTECODE": "",
            "PYTHONPYCACHEPREFIX": str(folder / "bytecode"),
        }  # as where it is installed
        self.fd, inside = pty.openpty()
        fcntl.ioctl(inside, termios.TIOCSWINSZ, struct.pack("HHHH", size[1], size[0], 0, 0))
        environment = os.environ | own | {"TERM": "xterm-256color", "COLORTERM": "truecolor", "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-m", "darko_gcs", *arguments]
        self.process = subprocess.Popen(  # noqa: S603 - our own program
            command, stdin=inside, stdout=inside, stderr=inside, env=environment, start_new_session=True
        )
        os.close(inside)

    def watch(self, seconds: float, until: bytes | None = None) -> bool:
        """Read what it draws for some time, or until it has drawn something."""
        end = time.perf_counter() + seconds
        while (left := end - time.perf_counter()) > 0.0:
            if select.select([self.fd], [], [], left)[0]:
                try:
                    self.screen += os.read(self.fd, 1 << 16)
                except OSError:  # it has ended
                    return False
                if until is not None and until in self.screen:
                    return True
        return False

    def used(self) -> float:
        """Processor time so far [s]."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / TICKS

    def close(self) -> None:
        """End it."""
        self.process.send_signal(signal.SIGTERM)
        while self.process.poll() is None:
            self.watch(0.1)
        os.close(self.fd)


def first_frame(size: tuple[int, int], folder: Path) -> tuple[float, float]:
    """Time from the start to the first frame, and processor time in it [s]."""
    terminal = Terminal(size, folder, "--port", "0")
    if not terminal.watch(FIRST_FRAME_LIMIT, FIRST_FRAME):
        terminal.close()
        raise SystemExit(f"no first frame within {FIRST_FRAME_LIMIT:.0f} s")
    taken = time.perf_counter() - terminal.begun, terminal.used()
    terminal.close()
    return taken


def save_charts(folder: Path) -> int:
    """Keep a view of the charts where the ground station looks for it; returns the number of its curves."""
    curves = [f"{message}.{field}" for message, fields in CHARTED.items() for field in fields.split()]
    curves += COMBINED
    view = ChartView("bench", tuple(tuple(curves[k::5]) for k in range(5)))
    ChartViews(folder / "darko" / "chart-views.toml").save(view)
    return len(curves)


def share_of_core(
    size: tuple[int, int], folder: Path, seconds: float, flight: tuple[str, ...], keys: tuple[bytes, ...] = ()
) -> tuple[float, int]:
    """Share of a core beside a vehicle in flight, and bytes drawn per second, after some keys."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    links = ("--port", "0", "--gcs-port", port, "--api-port", "0", "--state-dir", str(folder / "vehicle"))
    command = [sys.executable, "-m", "sitl", *links, "--quiet", *flight]
    vehicle = subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(ROOT)})  # noqa: S603 - our own program
    terminal = Terminal(size, folder, "--port", port)
    try:
        if not terminal.watch(COMPILED, b"ARMED"):
            raise SystemExit("no vehicle in flight")
        terminal.watch(3.0)
        os.write(terminal.fd, b"v")
        terminal.watch(1.0)
        os.write(terminal.fd, b"y")
        for key in keys:
            terminal.watch(2.0)
            os.write(terminal.fd, key)
        terminal.watch(SETTLED)
        begin, used, terminal.screen = time.perf_counter(), terminal.used(), b""
        terminal.watch(seconds)
        elapsed = time.perf_counter() - begin
        return (terminal.used() - used) / elapsed, round(len(terminal.screen) / elapsed)
    finally:
        terminal.close()
        vehicle.terminate()
        vehicle.wait()


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="200x60", help="of the terminal [200x60]")
    parser.add_argument("--seconds", type=float, default=20.0, help="for which its processor time is taken [20]")
    args, flight = parser.parse_known_args()
    columns, rows = (int(part) for part in args.size.split("x"))
    folder = Path(tempfile.mkdtemp(prefix="darko-bench-"))
    try:
        wall, used = min(first_frame((columns, rows), folder) for _ in range(STARTS))
        print(f"first frame at {args.size}: {wall:.2f} s, {used:.2f} s of it at work (best of {STARTS} starts)")
        share, drawn = share_of_core((columns, rows), folder, args.seconds, tuple(flight) or FLIGHT)
        print(f"at {args.size} for {args.seconds:.0f} s: {100 * share:.1f} % of a core, {drawn / 1e3:.1f} kB/s drawn")
        curves = save_charts(folder)
        share, drawn = share_of_core((columns, rows), folder, args.seconds, tuple(flight) or FLIGHT, CHART_KEYS)
        print(f"{curves} curves in charts: {100 * share:.1f} % of a core, {drawn / 1e3:.1f} kB/s drawn")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
