"""One request to the vehicle's flight plan, without a screen."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from darko_gcs.errors import FlightError, GroundError, LinkError
from darko_gcs.scripting import Vehicle, connect
from darko_gcs.state.flight_plan_state import FlightPlanState
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import PlanEventKind
from protocol.errors import ProtocolError
from protocol.flight_plans import load_flight_plan
from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.plan_names import NameMapping, load_name_mapping
from protocol.flight_plans.plan_package import pack_plan

PLAN_TIMEOUT = 15.0  # for the plan to arrive from a vehicle that is heard [s]


async def request_of_plan(args: argparse.Namespace) -> str:
    """Wait for the plan, then tell of it, or send the request and wait for its answer.

    Args:
        args: Options of ``darko-gcs plan``.

    Returns:
        What there is or what was done, for a person or as JSON.

    Raises:
        GroundError: The plan has no such thing, or the vehicle refused or did not answer; the message says which.
    """
    # What is wrong with a file is said before a vehicle is waited for.
    file = file_to_send(args.file, args.names, args.procedures) if args.act == "load" else b""
    where = {"vehicle": args.vehicle, "signing_key": args.signing_key, "station": args.id}
    async with connect(args.host, args.port, **where) as vehicle:
        try:
            if args.act == "load":
                await vehicle.load_flight_plan(file)
            else:
                plan = await _plan_of(vehicle)
                if args.act in {"status", "blocks"}:
                    table = status_table(vehicle.now, plan) if args.act == "status" else blocks_table(plan)
                    if not args.json:
                        return _as_text(table)
                    return json.dumps({"ok": True, **table} if isinstance(table, dict) else table, indent=1)
                await vehicle.request(lambda station, now: send_request(station, plan, args, now), f"plan {args.act}")
        except FlightError as error:  # nothing was flown: a refusal is one like that of an argument
            raise GroundError(str(error), **error.details) from error
    accepted = {"ok": True, "act": args.act, "result": "accepted"}
    return json.dumps(accepted) if args.json else f"plan {args.act}: accepted"


async def _plan_of(vehicle: Vehicle) -> FlightPlanState:
    try:
        s = await vehicle.wait_until(_has_plan, PLAN_TIMEOUT, "a flight plan")
    except FlightError as error:
        raise LinkError(f"the vehicle sent no flight plan within {PLAN_TIMEOUT:g} s") from error
    assert s.flight_plan is not None  # noqa: S101 - it was waited for
    return s.flight_plan


def file_to_send(path: Path, names: Path | None = None, procedures: Path | None = None) -> bytes:
    """The plan of a file with its procedures and its names, as it is sent.

    Args:
        path: Of the plan.
        names: TOML file of what the names of its build mean.
        procedures: A folder beside its own that the procedures it includes may lie in.

    Raises:
        GroundError: It cannot be read, or not be flown; the message says where.
    """
    try:
        plan = load_flight_plan(path, procedures)
        mapping = NameMapping() if names is None else load_name_mapping(names)
        check_flown(plan, mapping).require_flown()
    except ProtocolError as error:
        raise GroundError(str(error)) from None
    return pack_plan(plan, mapping)


def _has_plan(s: Snapshot) -> bool:
    return s.flight_plan is not None and s.flight_plan.is_complete


def send_request(station: Station, plan: FlightPlanState, args: argparse.Namespace, now: float) -> int:
    """Send what is asked for; gives its MAV_CMD.

    Raises:
        GroundError: The plan has no such block, waypoint or variable.
    """
    if args.act == "fly":
        station.flight_plan.start(now)
        return int(mavlink.MAV_CMD_DO_SET_MODE)
    if args.act == "jump":
        names = {block.name: block.number for block in plan.blocks.values()}
        names |= {str(number): number for number in plan.blocks if str(number) not in names}
        station.flight_plan.jump_to_block(_named(names, args.block, "block"), now)
        return int(mavlink.MAV_CMD_DARKO_JUMP_TO_BLOCK)
    if args.act == "move":
        number = _named({point.name: point.number for point in plan.points.values()}, args.waypoint, "waypoint")
        up = plan.points[number].position[2] if args.up is None else args.up
        station.flight_plan.move_waypoint(number, (args.east, args.north, up), now)
        return int(mavlink.MAV_CMD_DARKO_MOVE_WAYPOINT)
    number = _named({setting.name: setting.number for setting in plan.settings.values()}, args.variable, "variable")
    station.flight_plan.set_variable(number, args.value, now)
    return int(mavlink.MAV_CMD_DARKO_SET_VARIABLE)


def _named(numbers: dict[str, int], name: str, what: str) -> int:
    if name not in numbers:
        known = ", ".join(text for text in numbers if not text.isdigit())
        raise GroundError(f"the plan has no {what} {name!r}: it has {known or 'none'}")
    return numbers[name]


def status_table(s: Snapshot, plan: FlightPlanState) -> dict[str, Any]:
    """Status of the plan for a program, with its waypoints, its variables and its events."""
    return {
        "plan": plan.name,
        "flown": s.flies_plan,
        "block": plan.block_name(plan.block),
        "block_time": plan.block_time,
        "stage": plan.stage_text,
        "line": plan.line,
        "stage_time": plan.stage_time,
        "flight_time": plan.flight_time,
        "waypoints": {point.name: [round(part, 3) for part in point.position] for point in plan.points.values()},
        "variables": {setting.name: setting.value for setting in plan.settings.values()},
        "exceptions": [
            {"time": h.time, "text": h.text, "from": plan.block_name(h.from_block), "to": plan.block_name(h.to_block)}
            for h in plan.happenings
            if h.kind == PlanEventKind.EXCEPTION
        ],
        "remarks": [h.text for h in plan.happenings if h.kind == PlanEventKind.REMARK],
    }


def blocks_table(plan: FlightPlanState) -> list[dict[str, Any]]:
    """The blocks, for a program."""
    return [
        {
            "number": block.number,
            "name": block.name,
            "button": block.label if block.has_button else None,
            "key": block.key or None,
            "group": block.group or None,
            "locked": block.locked or None,
            "present": block.number == plan.block,
        }
        for block in plan.blocks.values()
    ]


def _as_text(table: dict[str, Any] | list[dict[str, Any]]) -> str:
    if isinstance(table, dict):
        return "\n".join(f"{key:<12} {_words(value)}" for key, value in table.items())
    return "\n".join(
        f"{'>' if row['present'] else ' '}{row['number']:3d} {row['key'] or '':<8} {row['name']:<28} "
        f"{'locked: ' + row['locked'] if row['locked'] else row['button'] or ''}".rstrip()
        for row in table
    )


def _words(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.1f}"
    if isinstance(value, dict):
        return ", ".join(f"{key} {_words(part)}" for key, part in value.items()) or "none"
    if isinstance(value, list):
        separator = " " if all(isinstance(part, float) for part in value) else "; "
        return separator.join(map(_words, value)) or "none"
    return str(value)
