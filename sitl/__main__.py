"""``darko-sitl``: the vehicle process and what can be run with the vehicle alone."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from importlib.metadata import version

from sitl.errors import SitlError

# Each command is a module of sitl.commands with configure(parser) and run(args) -> int.
COMMANDS = {
    "run": "fly the vehicle over MAVLink (what darko-sitl does when no command is named)",
    "scenario": "fly a named experiment of the report, print its figures, save its plot",
    "report": "run every experiment of the report and write one HTML page with verdicts",
    "campaign": "fly a square on the wing from many seeds, in wind and gusts with a wrong model, and count",
    "hybrid": "run a textbook hybrid system on the supervisor's engine",
    "region": "prove and fly the region of attraction of the linear hover law, and compare gains",
    "breakeven": "hover or fly: from which distance on the wing costs less, predicted and flown",
    "airframe": "list the parameter sets, or show one with units and sources",
}


def main(argv: list[str] | None = None) -> int:
    """Run a command. Expected errors are one line on stderr and exit code 2."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments == ["--version"]:
        print(f"darko-sitl {version('darko')}")
        return 0
    name = arguments.pop(0) if arguments and arguments[0] in COMMANDS else "run"
    command = import_module(f"sitl.commands.{name}")
    parser = command.parser(COMMANDS)
    try:
        return int(command.run(parser.parse_args(arguments)))
    except SitlError as error:
        print(f"darko-sitl: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader of our output, a pager or head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141


if __name__ == "__main__":
    sys.exit(main())
