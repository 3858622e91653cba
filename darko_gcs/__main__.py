"""``darko-gcs``: the ground station, and jobs that need no screen."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from darko_gcs.errors import GroundError
from protocol.command_line import run_cli

COMMANDS = {
    "connect": "open the ground station (the default command)",
    "fly": "fly a mission from a file, without a screen if --headless, and print the result",
    "replay": "replay a recorded flight on the same screens",
    "signing": "change the vehicle's signing key",
    "fail": "have an instrument, an actuator, the battery or the link of the vehicle fail, or heal it",
    "plan": "tell where the vehicle's flight plan is, enter a block, move a waypoint or set a variable",
    "log": "summarise a recorded flight, or download the vehicle's own logs",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command of ``darko_gcs.commands``; returns the exit code."""
    return run_cli("darko_gcs", "darko-gcs", COMMANDS, GroundError, argv)


if __name__ == "__main__":
    sys.exit(main())
