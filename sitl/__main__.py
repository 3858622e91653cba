"""``darko-sitl``: the vehicle process and what can be run with the vehicle alone."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from protocol.tools.command_line import run_cli
from sitl.commands.study import STUDIES
from sitl.errors import SitlError

COMMANDS = {
    "run": "fly the vehicle over MAVLink (what darko-sitl does when no command is named)",
    "plan": "check a flight plan: what is flown, what is refused, and the nearest mission",
    "day": "fly a day under the net from one file, headless: plan, wind, failures, operator; and write a page about it",
    "mocap": "serve the running vehicle's pose by NatNet, as the Motive of a motion-capture hall does",
    "airframe": "list the parameter sets, or show one with units and sources",
    "physics": "be the plant, the sensors and the world of somebody else's autopilot: ArduPilot, PX4 or Betaflight",
    "export": "write the controller that flies as C, for an autopilot, and prove it to be the same",
    "campaign": "fly any number of cases drawn by a file, on all cores or a cluster, and go on where it was stopped",
    "gym": "score our controllers and trained policies in the environments for agents, or fly a policy into a log",
    "optimal": "find the least time or energy of a leg, and print how near to it the vehicle flies",
    "study": "measure over many flights, reproduce the report, identify an airframe",
}
MOVED = {name: f"study {name}" for name in STUDIES if name not in COMMANDS}


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command of ``sitl.commands``; returns the exit code."""
    return run_cli("sitl", "darko-sitl", COMMANDS, SitlError, argv, MOVED)


if __name__ == "__main__":
    sys.exit(main())
