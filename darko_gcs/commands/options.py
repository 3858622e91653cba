"""Options that several commands share; those for scripts: the link, one time-out, and output for people or as JSON."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from protocol.tools.command_line import print_json
from protocol.tools.option_values import (
    GROUND_SYSTEM,
    OUTWARD_KINDS,
    STATION_PORT,
    VEHICLE_PORT,
    finite_number,
    port_number,
    positive_number,
    system_id,
)

if TYPE_CHECKING:
    from darko_gcs.scripting import Vehicle
    from darko_gcs.state.map_overlay import Overlay

SCREEN_OPTIONS = ("--dialect", "--on-alert", "--live-3d", "--overlay")
MAX_TIME_PARTS = 3  # hours, minutes, seconds
LIVE_PORT = 8001
KNOWN_PARAMETERS = "parameters.json"  # in the state folder: what our vehicle's parameters mean, as it told last


def add_screen_options(parser: argparse.ArgumentParser) -> None:
    """Options of every command that opens the screens on a vehicle."""
    parser.add_argument(
        "--dialect",
        metavar="NAME",
        help="dialect of pymavlink for messages that are not ours: ardupilotmega, common, paparazzi ... [all]",
    )
    parser.add_argument(
        "--on-alert",
        metavar="COMMAND",
        help="run this with the words of each alert: link lost, failsafe, crash, low battery, failures, "
        "commands of other stations [none]",
    )
    parser.add_argument(
        "--live-3d",
        type=port_number,
        nargs="?",
        const=LIVE_PORT,
        metavar="PORT",
        help=f"also draw the vehicle in 3-D in a browser on this machine [port {LIVE_PORT}; any free one with --web]",
    )
    add_overlay_option(parser)


def add_overlay_option(parser: argparse.ArgumentParser) -> None:
    """Add the option of every command that shows maps."""
    parser.add_argument(
        "--overlay", type=Path, metavar="FILE", help="shapes to lay over the maps, GeoJSON or KML [none]"
    )


def refuse_screen_options(args: argparse.Namespace) -> None:
    """Refuse what only screens can do.

    Raises:
        GroundError: Names the options that were given.
    """
    from darko_gcs.errors import GroundError

    given = [name for name in SCREEN_OPTIONS if getattr(args, name.lstrip("-").replace("-", "_")) is not None]
    if given:
        raise GroundError(f"{', '.join(given)}: for the screens, which --headless does not open")


def overlay_of(args: argparse.Namespace) -> Overlay:
    """The shapes of ``--overlay``; none without it.

    Raises:
        GroundError: The file cannot be read.
    """
    from darko_gcs.errors import GroundError
    from darko_gcs.state.map_overlay import load_overlay
    from protocol.errors import FileError

    try:
        return () if args.overlay is None else load_overlay(args.overlay)
    except FileError as error:
        raise GroundError(f"--overlay {error}") from error


def add_link_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the link, the recording and the vehicle process."""
    link = parser.add_argument_group("link")
    add_listen_options(link, f"{STATION_PORT}; with --sitl any free one", None)
    link.add_argument("--record", type=Path, metavar="DIR", help="folder for recorded flights [the user's data folder]")
    link.add_argument(
        "--give-key", action="store_true", help="give the key to a vehicle that has none; only over loopback"
    )
    sitl = parser.add_argument_group("vehicle process")
    sitl.add_argument("--sitl", action="store_true", help="start darko-sitl, and stop it at the end")
    sitl.add_argument("--vehicles", metavar="N", help="number of vehicles, on one port [1]")
    sitl.add_argument("--speed", metavar="X", help="simulation speed, times real time [1]")
    sitl.add_argument("--seed", metavar="N", help="random seed [1]")
    sitl.add_argument("--wind", metavar="M/S@DEG", help="steady wind and where it comes from [0]")
    sitl.add_argument("--gusts", metavar="RMS", help="gusts, rms speed in m/s [0]")
    sitl.add_argument(
        "--start", metavar="N,E,UP,YAW", help="start position in metres, heading in degrees; UP > 0: hovering [0,0,0,0]"
    )
    sitl.add_argument("--airframe", metavar="SET", help="parameter set or TOML file [darko]")
    sitl.add_argument(
        "--api-port",
        type=port_number,
        default=0,
        metavar="P",
        help="UDP port on this machine of another program that also gets the telemetry [none]",
    )
    sitl.add_argument("--state-dir", metavar="DIR", help="folder of the vehicle's saved parameters and mission")


def add_listen_options(
    link: argparse._ArgumentGroup, told: str = str(STATION_PORT), port: int | None = STATION_PORT
) -> None:
    """Add the options of the port to listen on, with its default and how that is told, of the vehicle and our id."""
    link.add_argument("--host", default="127.0.0.1", help="local address to listen on [127.0.0.1]")
    link.add_argument("--port", type=port_number, default=port, metavar="P", help=f"local UDP port; 0: any [{told}]")
    link.add_argument(
        "--connect",
        dest="host",
        type=outward_url,
        metavar="URL",
        help=f"connect out instead of listening: udpout:HOST:PORT (darko-sitl: udpout:127.0.0.1:{VEHICLE_PORT}), "
        "tcp:HOST:PORT, serial:DEVICE[:BAUD]",
    )
    link.add_argument(
        "--id",
        type=system_id,
        default=GROUND_SYSTEM,
        metavar="N",
        help="system id of this ground station: each station of a vehicle needs its own [255]",
    )
    link.add_argument(
        "--vehicle", type=system_id, metavar="ID", help="system id of the vehicle, 1 to 255 [the first one heard]"
    )
    link.add_argument(
        "--signing-key",
        metavar="KEY",
        help="sign, and accept only signed messages: 64 hexadecimal digits or a file with them (passed on to --sitl)",
    )


def outward_url(text: str) -> str:
    """An address to connect to, by its kind; what follows is checked as it is opened."""
    kind, colon, _ = text.partition(":")
    if kind not in OUTWARD_KINDS or not colon:
        raise argparse.ArgumentTypeError(
            f"{text!r} is no address to connect to: udpout:HOST:PORT, tcp:HOST:PORT or serial:DEVICE[:BAUD]"
        )
    return text


def add_span_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of a span of a flight."""
    for name, where, edge, default in (("--from", "begin", "start", -math.inf), ("--to", "end", "end", math.inf)):
        parser.add_argument(
            name,
            dest=where,
            type=clock_time,
            default=default,
            metavar="TIME",
            help=f"{edge} of the time span: seconds, M:SS or H:MM:SS, as 'log info' tells them [the log's]",
        )


def add_log_vehicle_option(parser: argparse.ArgumentParser) -> None:
    """Add the option that chooses a vehicle of a log, and that of output for programs."""
    parser.add_argument(
        "--vehicle", type=system_id, metavar="ID", help="of several vehicles in the log, the one with this system id"
    )
    parser.add_argument("--json", action="store_true", help="print the result, or the failure, as JSON")


def clock_time(text: str) -> float:
    """A time [s], given in seconds or as the clock on the screen shows it."""
    parts = text.split(":")
    if len(parts) > MAX_TIME_PARTS or not all(part.isdigit() for part in parts[:-1]):
        raise argparse.ArgumentTypeError(f"{text!r} is not a time: seconds, M:SS or H:MM:SS")
    total = sum(60.0**power * finite_number(part) for power, part in enumerate(reversed(parts)))
    if total < 0.0:
        raise argparse.ArgumentTypeError(f"{text} is before the beginning")
    return total


def listening_port(args: argparse.Namespace) -> int:
    """The port to listen on: with --sitl a free one, so that no other session's vehicle is heard; 0: any."""
    if args.port is not None:
        return int(args.port)
    return 0 if getattr(args, "sitl", False) else STATION_PORT


def checked_sitl_arguments(args: argparse.Namespace) -> list[str]:
    """The options that are passed on to darko-sitl, which has read them.

    Raises:
        GroundError: darko-sitl refuses them.
    """
    arguments = _sitl_arguments(args)
    if args.sitl and arguments:
        from darko_gcs.feed.sitl_process import check_arguments

        check_arguments(arguments, args.airframe)
    return arguments


def _sitl_arguments(args: argparse.Namespace) -> list[str]:
    names = ("signing_key", "vehicles", "speed", "seed", "wind", "gusts", "start", "airframe", "state_dir")
    given = [(name, getattr(args, name)) for name in names if getattr(args, name) is not None]
    return [part for name, value in given for part in (f"--{name.replace('_', '-')}", str(value))]


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
    where = {"vehicle": args.vehicle, "signing_key": args.signing_key, "timeout": args.timeout, "station": args.id}
    async with connect(args.host, args.port, **where) as vehicle:
        try:
            return await asyncio.wait_for(job(vehicle), args.timeout)
        except TimeoutError:
            raise vehicle.late(f"not done within {args.timeout:g} s") from None


def tell_where(args: argparse.Namespace) -> None:
    """Say on stderr where a vehicle is waited for."""
    from darko_gcs.feed.links import outward_address

    place = f"{args.host}:{args.port}" if outward_address(args.host) is None else args.host
    print(f"darko-gcs: waiting for a vehicle on {place}", file=sys.stderr, flush=True)
