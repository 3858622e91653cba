"""A command for scripts to every vehicle on the link: all are asked at once, and each has its own answer."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from darko_gcs.commands.script_options import Job, Result, tell_where
from protocol.tools.command_line import print_json

if TYPE_CHECKING:
    from collections.abc import Callable

    from darko_gcs.scripting import Vehicle


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
    from darko_gcs.scripting.vehicles import connect_all
    from protocol.errors import ProtocolError

    async def answer(vehicle: Vehicle) -> Result | Exception:
        try:
            return await asyncio.wait_for(job(vehicle), args.timeout)
        except TimeoutError:
            return vehicle.late(f"not done within {args.timeout:g} s")
        except (GroundError, ProtocolError) as error:
            return error

    tell_where(args)
    async with connect_all(args.host, args.port, signing_key=args.signing_key, timeout=args.timeout) as vehicles:
        answers = await asyncio.gather(*map(answer, vehicles.values()))
        return dict(zip(vehicles, answers, strict=True))
