"""``darko-gcs cmd``: one command to the vehicle or to every vehicle on the link, from a script."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from darko_gcs.commands.options import EXIT_CODES, Job, Result, add_script_options, run_script, tell_where
from protocol.tools.command_line import command_parser, print_json

if TYPE_CHECKING:
    from collections.abc import Callable

    from darko_gcs.scripting import Vehicle
    from darko_gcs.state.snapshot import Snapshot


def run_script_for_all(args: argparse.Namespace, job: Job, words: Callable[[Result], str]) -> int:
    """Connect, do a job with every vehicle and print the results; the exit code, 4 if it failed with one of them.

    Args:
        args: With the options of ``add_script_options``.
        job: Gives what is printed of a vehicle as JSON.
        words: The same for a person.

    Raises:
        GroundError: No vehicle is heard, or as JSON: one of them failed.
    """
    import asyncio

    from darko_gcs.errors import FlightError

    results = asyncio.run(_of_all(args, job))
    failed = [system for system, result in results.items() if isinstance(result, Exception)]
    if not args.json:
        for system, result in results.items():
            print(f"vehicle {system}: {result if isinstance(result, Exception) else words(result)}")
        return FlightError.exit_code if failed else 0
    told = {
        str(system): {"ok": False, "error": str(result), **getattr(result, "details", {})}
        if isinstance(result, Exception)
        else {"ok": True, **result}
        for system, result in results.items()
    }
    if failed:
        raise FlightError(f"not done by vehicle{'s' * (len(failed) > 1)} {', '.join(map(str, failed))}", vehicles=told)
    print_json({"ok": True, "vehicles": told})
    return 0


async def _of_all(args: argparse.Namespace, job: Job) -> dict[int, Result | Exception]:
    import asyncio

    from darko_gcs.errors import GroundError
    from darko_gcs.scripting.vehicle import connect_all
    from protocol.errors import ProtocolError

    async def answer(vehicle: Vehicle) -> Result | Exception:
        try:
            return await asyncio.wait_for(job(vehicle), args.timeout)
        except TimeoutError:
            return vehicle.late(f"not done within {args.timeout:g} s")
        except (GroundError, ProtocolError) as error:
            return error

    tell_where(args)
    where = {"signing_key": args.signing_key, "timeout": args.timeout, "station": args.id}
    async with connect_all(args.host, args.port, **where) as vehicles:
        answers = await asyncio.gather(*map(answer, vehicles.values()))
        return dict(zip(vehicles, answers, strict=True))


_EXAMPLES = f"""\
examples:
  darko-gcs cmd arm --wait            wait until it can be armed, then arm
  darko-gcs cmd takeoff 5 --wait      and wait until it is there
  darko-gcs cmd goto 10 0 8           north, east of home, height above it [m]
  darko-gcs cmd mode LAND --json
  darko-gcs cmd hold --vehicle 3      of several vehicles on the link, the one with system id 3
  darko-gcs cmd land --all            all of them
  darko-gcs cmd reboot                start the autopilot anew, as after a crash

{EXIT_CODES}"""

COMMAND_WORDS = {  # number of values
    "arm": 0, "disarm": 0, "kill": 0, "takeoff": 1, "goto": 3, "land": 0, "rtl": 0, "hold": 0, "mode": 1, "start": 0,
    "forward": 0, "hover": 0, "speed": 1, "reboot": 0,
}  # fmt: skip
AT_HEIGHT, AT_PLACE = 0.5, 1.0  # near enough to a height and a place [m]


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs cmd``."""
    parser = command_parser("darko-gcs cmd", commands, _EXAMPLES)
    parser.add_argument("action", choices=list(COMMAND_WORDS), help="what to do; kill stops the motors in flight")
    parser.add_argument("values", nargs="*", help="height of takeoff, north east height of goto, a mode, a speed")
    parser.add_argument("--wait", action="store_true", help="wait until it is done, not only accepted")
    add_script_options(parser)
    parser.add_argument(
        "--all", action="store_true", help="command every vehicle that is heard within 2.5 s; each answers for itself"
    )
    return parser


def run(args: argparse.Namespace) -> int:
    """Send the command and print the answer.

    Raises:
        GroundError: It was refused or not answered, or an argument is wrong.
    """
    from darko_gcs.errors import GroundError

    if args.all and args.vehicle is not None:
        raise GroundError("--all and --vehicle cannot be combined")
    wanted = COMMAND_WORDS[args.action]
    if len(args.values) != wanted:
        raise GroundError(f"{args.action} takes {wanted} value{'s' * (wanted != 1)}, not {len(args.values)}")
    values: list[Any] = list(args.values)
    if args.action != "mode":
        try:
            values = [float(text) for text in args.values]
        except ValueError:
            raise GroundError(f"{args.action}: {' '.join(args.values)} are not numbers") from None
    run_job = run_script_for_all if args.all else run_script
    return run_job(args, lambda vehicle: _do(vehicle, args.action, values, wait=args.wait), _words)


async def _do(vehicle: Vehicle, action: str, values: list[Any], *, wait: bool) -> dict[str, Any]:
    if action == "mode":
        await vehicle.set_mode(_mode(values[0]))
    elif action == "arm":
        if wait:
            await vehicle.ready()
        await vehicle.arm()
    elif action in {"takeoff", "goto", "speed"}:
        calls = {"takeoff": vehicle.take_off, "goto": vehicle.go_to, "speed": vehicle.change_speed}
        await calls[action](*values)  # type: ignore[operator] # each takes its own number of values
    elif action in {"forward", "hover"}:
        await vehicle.transition(forward=action == "forward")
    elif action == "kill":
        await vehicle.disarm(force=True)
    else:
        calls_alone = {
            "disarm": vehicle.disarm, "land": vehicle.land, "rtl": vehicle.return_home, "hold": vehicle.hold,
            "start": vehicle.start_mission, "reboot": vehicle.reboot,
        }  # fmt: skip
        await calls_alone[action]()
    if wait:
        await _until_done(vehicle, action, values)
    s = vehicle.now
    return {"action": action, "values": values, "mode": s.status.mode, "armed": s.status.armed}


async def _until_done(vehicle: Vehicle, action: str, values: list[Any]) -> None:
    forever = 1e9  # the command's own time-out ends it
    if action == "takeoff":
        await vehicle.wait_until(
            lambda s: (s.position.relative_altitude or 0.0) > values[0] - AT_HEIGHT,
            forever,
            lambda s: f"a height of {values[0] - AT_HEIGHT:g} m (it is at {s.position.relative_altitude or 0.0:.1f} m)",
        )
    elif action == "goto":
        await vehicle.wait_until(
            lambda s: max(_off(s, values)) < AT_PLACE,
            forever,
            lambda s: f"the place ({_off(s, values)[0]:.1f} m away from it, {_off(s, values)[1]:.1f} m off its height)",
        )
    elif action in {"land", "rtl", "disarm", "kill"}:
        await vehicle.wait_until(lambda s: s.status.armed is False, forever, "the motors to stop")


def _off(s: Snapshot, wanted: list[float]) -> tuple[float, float]:
    """Distance of a vehicle from a place relative to home, horizontal and in height [m]."""
    north, east, height = wanted
    if s.position.p is None:
        return math.inf, math.inf
    return (
        math.hypot(s.position.p[0] - s.position.home_p[0] - north, s.position.p[1] - s.position.home_p[1] - east),
        abs((s.position.relative_altitude or 0.0) - height),
    )


def _mode(name: str) -> Any:  # noqa: ANN401 - a Mode, whose module --help must not load
    from darko_gcs.errors import GroundError
    from darko_gcs.scripting import Mode

    if name.upper() not in Mode.__members__:
        raise GroundError(f"mode {name} is not one of {', '.join(Mode.__members__)}")
    return Mode[name.upper()]


def _words(result: dict[str, Any]) -> str:
    given = " ".join(str(value) for value in result["values"])
    return f"{result['action']}{' ' * bool(given)}{given}: accepted"
