"""``darko-gcs mission``: the vehicle's mission, from a script."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from darko_gcs.commands.options import EXIT_CODES, Result, add_actions, add_verify_option, check_values, run_script
from protocol.tools.command_line import command_parser

if TYPE_CHECKING:
    from darko_gcs.scripting import Vehicle

_EXAMPLES = f"""\
examples:
  darko-gcs mission upload square.plan       and read it back: exit code 4 if the vehicle holds something else
  darko-gcs mission download back.plan       with fence, rally points and home; .waypoints (QGC WPL 110) has the mission
  darko-gcs mission clear
  darko-gcs mission status --json

{EXIT_CODES}"""
MISSION_ACTIONS = {"upload": (1,), "download": (1,), "clear": (0,), "status": (0,)}


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs mission``."""
    parser = command_parser("darko-gcs mission", commands, _EXAMPLES)
    add_actions(parser, MISSION_ACTIONS, "a file")
    add_verify_option(parser)
    return parser


def run(args: argparse.Namespace) -> int:
    """Move the mission and print the result.

    Raises:
        GroundError: The vehicle refused or did not answer, or an argument is wrong.
    """
    from darko_gcs.errors import GroundError
    from protocol.errors import FileError
    from protocol.plans import load
    from protocol.plans.plan_files import require_plan_suffix

    check_values(args, "mission", MISSION_ACTIONS, "file")
    try:  # a wrong file needs no vehicle
        if args.action == "upload":
            load(Path(args.values[0]))
        elif args.action == "download":
            require_plan_suffix(Path(args.values[0]))
    except FileError as error:
        raise GroundError(str(error)) from error
    return run_script(args, lambda vehicle: _do(vehicle, args.action, args.values, verify=args.verify), _words)


async def _do(vehicle: Vehicle, action: str, values: list[str], *, verify: bool) -> Result:
    if action == "upload":
        return await _upload(vehicle, values[0], verify=verify)
    if action == "clear":
        await vehicle.clear_mission()
        return {"items": 0}
    if action == "download":
        return await _download(vehicle, values[0])
    items, s = await vehicle.download(), vehicle.now
    return {"items": len(items), "current": s.mission.current, "reached": sorted(s.mission.reached)}


async def _upload(vehicle: Vehicle, file: str, *, verify: bool) -> Result:
    from protocol.plans import load
    from protocol.plans.fence_rally import fence_items, rally_items

    plan = load(Path(file))
    items = await vehicle.upload(file, verify=verify)
    parts = {"fence": len(fence_items(plan)), "rally": len(rally_items(plan))}
    return {"items": items, **parts, "file": file, "verified": verify}


async def _download(vehicle: Vehicle, file: str) -> Result:
    from darko_gcs.scripting.vehicle import save_downloaded
    from protocol.plans.fence_rally import fence_items, rally_items

    plan = await vehicle.download_plan()
    left_out = save_downloaded(plan, Path(file))
    home = plan.planned_home
    return {
        "items": len(plan.items),
        "fence": len(fence_items(plan)),
        "rally": len(rally_items(plan)),
        "home": None if home is None else [home.lat_deg, home.lon_deg, home.alt],
        "file": file,
        **({"left_out": left_out} if left_out else {}),
    }


def _words(result: Result) -> str:
    from darko_gcs.state.text import counted

    rest = f", at item {result['current']}, reached {result['reached']}" if "current" in result else ""
    if "verified" in result:
        rest = ", read back and identical" if result["verified"] else ", not read back"
    parts = [counted(result["items"], "item")]
    named = (("fence", "fence item"), ("rally", "rally point"))
    parts += [counted(result[key], what) for key, what in named if result.get(key)]
    parts += ["home"] if result.get("home") is not None else []
    left_out = "".join(f"\nleft out: {what}" for what in result.get("left_out", ()))
    return ", ".join(parts) + (f": {result['file']}" if "file" in result else "") + rest + left_out
