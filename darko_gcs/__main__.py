"""``darko-gcs``: the ground station and what can be done with flights without a screen."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from importlib.metadata import version

from darko_gcs.errors import GroundError

# Each command is a module of darko_gcs.commands with parser(commands) and run(args) -> int.
COMMANDS = {
    "connect": "open the ground station (what darko-gcs does when no command is named)",
    "fly": "fly a mission from a file without a screen, and say how it went",
    "replay": "play a recorded flight through the same screens",
    "signing": "change the vehicle's signing key",
    "log": "say what is in a recorded flight, or fetch the vehicle's own",
}


def main(argv: list[str] | None = None) -> int:
    """Run a command. Expected errors are one line on stderr and an exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments == ["--version"]:
        print(f"darko-gcs {version('darko')}")
        return 0
    name = arguments.pop(0) if arguments and arguments[0] in COMMANDS else "connect"
    command = import_module(f"darko_gcs.commands.{name}")
    try:
        return int(command.run(command.parser(COMMANDS).parse_args(arguments)))
    except GroundError as error:
        print(f"darko-gcs: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader of our output, a pager or head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141


if __name__ == "__main__":
    sys.exit(main())
