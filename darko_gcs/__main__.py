"""``darko-gcs``: the ground station, and jobs that need no screen."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from darko_gcs.errors import GroundError
from protocol.tools.command_line import run_cli

COMMANDS = {
    "connect": "open the ground station (the default command)",
    "fly": "fly a mission from a file, without a screen if --headless, and print the result",
    "watch": "print what the vehicle reports, a line at a time",
    "cmd": "send the vehicle a command: arm, takeoff, goto, land, mode...",
    "param": "list, read, change, save and load the vehicle's parameters",
    "mission": "upload, download and clear the vehicle's mission",
    "replay": "replay a recorded flight on the same screens",
    "signing": "change the vehicle's signing key",
    "bridge": "send the poses of a motion-capture hall (NatNet) to an autopilot, as MAVLink",
    "fail": "have an instrument, an actuator, the battery or the link of the vehicle fail, or clear the failure",
    "plan": "show the flight plan's block and stage, enter a block, move a waypoint or set a variable",
    "log": "summarise a recorded flight, or download the vehicle's own logs",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command of ``darko_gcs.commands``; returns the exit code."""
    return run_cli("darko_gcs", "darko-gcs", COMMANDS, GroundError, argv)


if __name__ == "__main__":
    sys.exit(main())
