"""Options that the commands for scripts share: the link, one time-out, and output for people or as JSON."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Any

from darko_gcs.commands.options import add_listen_options
from protocol.tools.command_line import print_json
from protocol.tools.option_values import positive_number

if TYPE_CHECKING:
    from darko_gcs.scripting import Vehicle

Result = dict[str, Any]
Job = Callable[["Vehicle"], Awaitable[Result]]
Actions = Mapping[str, tuple[int, ...]]  # of a command, and how many values each takes

EXIT_CODES = """\
exit codes: 0 done; 2 an argument or a file; 3 no link or no vehicle; 4 refused, or not done in time.
With --json the answer is one JSON object on stdout, also on failure:
{"ok": false, "command": "...", "error": "...", "exit_code": 3}.
"""


def add_script_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of every command for scripts."""
    parser.add_argument("--json", action="store_true", help="print JSON, also on failure")
    parser.add_argument(
        "--timeout",
        type=positive_number,
        default=60.0,
        metavar="S",
        help="maximum wait for a vehicle, and again for the command [60]",
    )
    add_listen_options(parser.add_argument_group("link"))


def add_actions(parser: argparse.ArgumentParser, actions: Actions, values: str) -> None:
    """Add what a command does, its values (in words), and the options of every command for scripts."""
    parser.add_argument("action", choices=list(actions), help="what to do")
    parser.add_argument("values", nargs="*", help=values)
    add_script_options(parser)


def add_verify_option(parser: argparse.ArgumentParser) -> None:
    """Add the option not to read a plan back."""
    parser.add_argument(
        "--no-verify",
        dest="verify",
        action="store_false",
        help="do not read an uploaded plan back and compare it: for autopilots that change what they are sent",
    )


def check_values(args: argparse.Namespace, command: str, actions: Actions, noun: str) -> None:
    """Refuse an action that was given another number of values than it takes.

    Raises:
        GroundError: Names the action and both numbers.
    """
    from darko_gcs.errors import GroundError

    counts = actions[args.action]
    if len(args.values) not in counts:
        nouns = noun + "s" * (counts != (1,))
        raise GroundError(
            f"{command} {args.action} takes {' or '.join(map(str, counts))} {nouns}, not {len(args.values)}"
        )


def run_script(args: argparse.Namespace, job: Job, words: Callable[[Result], str]) -> int:
    """Connect, do a job and print its result; the exit code.

    Args:
        args: With the options of ``add_script_options``.
        job: Gives what is printed as JSON.
        words: The same for a person.

    Raises:
        GroundError: It failed.
    """
    import asyncio

    from darko_gcs.errors import FlightError, GroundError
    from protocol.errors import ProtocolError

    try:
        result = asyncio.run(_connected(args, job))
    except ProtocolError as error:
        raise GroundError(str(error)) from error
    if failed := result.get("error"):  # a part of the job
        if not args.json:
            print(words(result))
        raise FlightError(failed, **result)
    if args.json:
        print_json({"ok": True, **result})
    else:
        print(words(result))
    return 0


async def _connected(args: argparse.Namespace, job: Job) -> Result:
    import asyncio

    from darko_gcs.scripting import connect

    tell_where(args)
    where = {"vehicle": args.vehicle, "signing_key": args.signing_key, "timeout": args.timeout}
    async with connect(args.host, args.port, **where) as vehicle:
        try:
            return await asyncio.wait_for(job(vehicle), args.timeout)
        except TimeoutError:
            raise vehicle.late(f"not done within {args.timeout:g} s") from None


def tell_where(args: argparse.Namespace) -> None:
    """Say on stderr where a vehicle is waited for."""
    from darko_gcs.feed.outward_link import outward_address

    place = f"{args.host}:{args.port}" if outward_address(args.host) is None else args.host
    print(f"darko-gcs: waiting for a vehicle on {place}", file=sys.stderr, flush=True)
