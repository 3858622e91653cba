"""A whole flight by MAVProxy, typed into it line by line. Needs ``pip install mavproxy`` and a running ``darko-sitl``.

By hand::

    darko-sitl --speed 5 &
    python scripts/clients/mavproxy_session.py

MAVProxy's answer to every typed line is printed; a missing answer ends the session with exit code 1. ``mode NAME`` is
not typed: MAVProxy 1.8.75 cannot send a PX4 mode by its name, ``long DO_SET_MODE`` can.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import IO

from sitl.defaults import HOME

FLIGHT_TIMEOUT = 90.0  # for anything that is flown [s]
MODES = {"MISSION": "129 4 4", "LOITER": "129 4 3", "RTL": "129 4 5"}  # base mode, main mode, sub-mode
# Those of its own list that have something to do with this vehicle.
MODULES = "log,signing,wp,rally,fence,ftp,param,arm,mode,rc,misc,cmdlong,battery"
# Up, over three corners, down: command, north and east of home [m], relative altitude [m].
ITEMS = ((22, 0, 0, 5), (16, 10, 0, 5), (16, 10, 10, 6), (16, 0, 10, 5), (21, 0, 0, 0))
METRE = 1.0 / 111195.08  # of latitude [deg]

# A typed line, and a regular expression that the answer must match; with an empty line the text comes by itself.
DIALOGUE = (
    ("", r"online system 1"),
    ("", r"Received \d+ parameters"),
    ("mode", r"Available modes: .*LOITER"),
    ("param set MIS_TAKEOFF_ALT 4; param fetch MIS_TAKEOFF_ALT", r"MIS_TAKEOFF_ALT = 4\.0"),
    ("param set DRK_WAY 1; param fetch DRK_WAY", r"DRK_WAY = 1\b"),
    ("param fetch", r"Received \d+ parameters"),
    ("wp load {plan}", r"Loaded 5 waypoints in"),
    ("wp list", r"Requesting 5 waypoints(?s:.*)Saved 5 waypoints to .*way.txt"),
    ("wp changealt 2 6", r"Got MISSION_ACK: TYPE_MISSION: ACCEPTED"),
    ("fence list", r"Requesting 0 fence items"),
    ("version", ""),
    ("status AUTOPILOT_VERSION", r"flight_sw_version : \d+"),
    ("gethome", ""),
    ("status HOME_POSITION", r"latitude : 435648000"),
    ("log list", r"No logs|Log \d+"),
    ("disarm", r"Got COMMAND_ACK: COMPONENT_ARM_DISARM: ACCEPTED"),
    ("arm throttle", r"\bARMED"),
    ("takeoff 4", r"TAKEOFF>(?s:.*)LOITER>"),
    ("disarm", r"COMPONENT_ARM_DISARM: DENIED"),
    ("long DO_SET_MODE {MISSION}", r"MISSION>(?s:.*)waypoint 1"),
    ("", r"waypoint 2"),
    ("wp set 3", r"DO_SET_MISSION_CURRENT: ACCEPTED(?s:.*)waypoint 3"),
    ("long DO_SET_MODE {LOITER}", r"DO_SET_MODE: ACCEPTED"),
    ("long DO_SET_MODE {RTL}", r"RTL>(?s:.*)DISARMED"),
    ("link", r"link 1 OK \(\d+ packets, .* \d+ lost, 0\.\d% loss"),
)


class Terminal:
    """MAVProxy as a child process: its keyboard and its screen."""

    def __init__(self, master: str, folder: Path) -> None:
        program = Path(sys.executable).with_name("mavproxy.py")
        command = [
            sys.executable, "-u", str(program), "--master", master, "--state-basedir", str(folder),
            "--logfile", str(folder / "flight.tlog"), "--mav20", "--default-modules", MODULES,
        ]  # fmt: skip
        self.text = ""
        self._from = 0  # start of the text that has not been matched yet
        self._news = threading.Condition()
        environment = {**os.environ, "HOME": str(folder)}  # so that no start script of the user runs
        self._process = subprocess.Popen(  # noqa: S603 - MAVProxy itself
            command, cwd=folder, env=environment, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        assert self._process.stdin is not None  # noqa: S101 - both are pipes
        assert self._process.stdout is not None  # noqa: S101
        self._keys, self._screen = self._process.stdin, self._process.stdout
        self._reader = threading.Thread(target=self._read, args=(self._screen,))
        self._reader.start()

    def type(self, line: str) -> None:
        """Type one line."""
        self._keys.write(line + "\n")
        self._keys.flush()

    def wait(self, pattern: str, timeout: float = FLIGHT_TIMEOUT) -> str | None:
        """The first printed text after the last match that matches; None if it does not come in time."""
        with self._news:
            if not self._news.wait_for(lambda: self._find(pattern) or self._process.poll() is not None, timeout):
                return None
            found = self._find(pattern)
            if found is None:
                return None
            self._from += found.end()
            return found[0]

    def close(self) -> None:
        """End the input, upon which MAVProxy writes its log and ends."""
        self._keys.close()
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join()
        self._screen.close()

    def _find(self, pattern: str) -> re.Match[str] | None:
        return re.search(pattern, self.text[self._from :])

    def _read(self, screen: IO[str]) -> None:
        for line in screen:
            with self._news:
                self.text += line
                self._news.notify_all()
        with self._news:
            self._news.notify_all()


def main(argv: list[str] | None = None) -> int:
    """Type the dialogue; exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--master", default="udpin:127.0.0.1:14550", help="address that the vehicle sends to [%(default)s]"
    )
    parser.add_argument("--folder", type=Path, default=None, help="folder for MAVProxy's logs [a temporary one]")
    arguments = parser.parse_args(argv)
    if arguments.folder is not None:
        return _run_dialogue(arguments.master, arguments.folder)
    with tempfile.TemporaryDirectory() as folder:
        return _run_dialogue(arguments.master, Path(folder))


def _run_dialogue(master: str, folder: Path) -> int:
    plan = folder / "plan.waypoints"
    plan.write_text(_waypoints(), encoding="ascii")
    terminal = Terminal(master, folder)
    began = time.monotonic()
    try:
        for line, answer in DIALOGUE:
            typed = line.format(plan=plan, **MODES)
            found = _type_and_wait(terminal, typed, answer)
            if found is None:
                print(f"FAILED {typed or 'start'}: no answer like {answer!r} in\n{terminal.text}", flush=True)
                return 1
            print(f"  {' | '.join(found.splitlines()[-2:])}", flush=True)
            print(f"ok {line or '...'} at {time.monotonic() - began:.1f} s", flush=True)
    finally:
        terminal.close()
    return 0


def _type_and_wait(terminal: Terminal, typed: str, answer: str) -> str | None:
    # MAVProxy sets parameters and asks for messages in the background: look until it is done.
    again = typed.startswith(("param set ", "status "))
    for _ in range(30 if again else 1):
        for line in filter(None, typed.split("; ")):
            terminal.type(line)
        found = terminal.wait(answer, 1.0 if again else FLIGHT_TIMEOUT) if answer else ""
        if found is not None:
            return found
    return None


def _waypoints() -> str:
    """The plan as a file of MAVProxy's own format."""
    rows = [
        f"{seq}\t{int(seq == 0)}\t3\t{command}\t0\t0\t0\t0\t{HOME.lat_deg + north * METRE:.7f}\t"
        f"{HOME.lon_deg + east * METRE / 0.7246:.7f}\t{up}\t1\n"
        for seq, (command, north, east, up) in enumerate(ITEMS)
    ]
    return "QGC WPL 110\n" + "".join(rows)


if __name__ == "__main__":
    sys.exit(main())
