"""Flight plans: what of one is flown, what is refused, and the nearest mission."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from protocol.errors import ProtocolError
from protocol.flight_plans.mission_export import Loss, to_mission
from protocol.flight_plans.plan_check import Finding, PlanCheck
from protocol.plans import save
from protocol.tools.command_line import CommandParser
from sitl.errors import SitlError
from sitl.tools.persistence import load_checked_plan

EXIT_REFUSED = 2
MISSION_SUFFIXES = (".plan", ".waypoints")


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl plan``."""
    options = CommandParser(
        prog="darko-sitl plan",
        description=commands["plan"] + ".",
        epilog="Exit code 0: all of it is flown; 2: something is refused.",
    )
    options.add_argument("file", type=Path, help="flight plan (XML); the procedures it includes lie beside or below it")
    options.add_argument(
        "--names", type=Path, metavar="FILE", help="TOML file: what functions and variables of a build mean"
    )
    options.add_argument(
        "--procedures", type=Path, metavar="DIR", help="another folder that the procedures it includes may lie in"
    )
    options.add_argument("--json", action="store_true", help="print the findings as JSON")
    options.add_argument(
        "--to", type=Path, metavar="FILE", help="also save the nearest mission: .plan or .waypoints; lists what is lost"
    )
    return options


def run(args: argparse.Namespace) -> int:
    """Check a plan, and export it."""
    if args.to is not None and args.to.suffix not in MISSION_SUFFIXES:
        raise SitlError(f"--to {args.to}: the suffix of a mission is {' or '.join(MISSION_SUFFIXES)}")
    check = load_checked_plan(args.file, args.names, args.procedures).check
    losses = _export(check, args.to) if args.to is not None else ()
    if args.json:
        print(json.dumps(_as_table(check, losses), indent=2))
    else:
        print("\n".join(_as_lines(check, losses, args.to)))
    return EXIT_REFUSED if check.refusals else 0


def _export(check: PlanCheck, path: Path) -> Sequence[Loss]:
    export = to_mission(check.plan, with_fence_of_sector=path.suffix == ".plan")
    try:
        save(export.mission, path)
    except ProtocolError as error:
        raise SitlError(str(error)) from None
    return export.losses


def _as_lines(check: PlanCheck, losses: Sequence[Loss], path: Path | None) -> Iterator[str]:
    plan, locked = check.plan, check.locked_blocks
    yield f"{plan.name}: {len(plan.waypoints)} waypoints, {len(plan.blocks)} blocks"
    for number, block in enumerate(plan.blocks):
        state = f"locked: {locked[block.name].construct}" if block.name in locked else "flown"
        yield f"  {number:3d} {block.name:<32} {state}"
    yield from (f"refused: {finding}{_of_block(finding)}" for finding in check.refusals)
    yield from (f"left out: {finding}" for finding in check.notices)
    if path is not None:
        yield f"saved {path}; not in it:"
        yield from (f"  {loss}" for loss in losses)
    if any(finding.block is None for finding in check.refusals):
        yield "The plan is refused."
    elif locked:
        yield f"The plan is flown; {len(locked)} of its blocks {'is' if len(locked) == 1 else 'are'} locked."
    else:
        yield "All of it is flown, but for what is left out." if check.left_out else "All of it is flown."


def _of_block(finding: Finding) -> str:
    return "" if finding.block is None else f" (block {finding.block})"


def _as_table(check: PlanCheck, losses: Sequence[Loss]) -> dict[str, Any]:
    plan, locked = check.plan, check.locked_blocks
    return {
        "ok": not check.refusals,
        "name": plan.name,
        "origin": {"lat": plan.lat0, "lon": plan.lon0, "alt": plan.ground_alt},
        "blocks": [{"name": block.name, "flown": block.name not in locked} for block in plan.blocks],
        "waypoints": [point.name for point in plan.waypoints],
        "refused": [_finding(finding) for finding in check.refusals],
        "left_out": [_finding(finding) for finding in check.notices],
        "lost": [{"file": loss.place.file, "line": loss.place.line, "what": loss.text} for loss in losses],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    place = finding.place
    return {
        "file": place.file,
        "line": place.line,
        "column": place.column,
        "construct": finding.construct,
        "reason": finding.reason,
        "block": finding.block,
    }
