"""``darko-gcs param``: the vehicle's parameters, from a script."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from darko_gcs.commands.options import EXIT_CODES, Job, Result, add_actions, check_values, run_script
from protocol.tools.command_line import command_parser

if TYPE_CHECKING:
    from darko_gcs.scripting import Vehicle
    from darko_gcs.state.parameters import ParameterMetadata
    from protocol.plans.parameter_files import ParameterFile

_EXAMPLES = f"""\
examples:
  darko-gcs param list
  darko-gcs param get DRK_HOV_VMAX
  darko-gcs param set DRK_HOV_VMAX 2
  darko-gcs param set NAV_DLL_ACT return  the name of a value; names of bits with commas between
  darko-gcs param save mine.params        QGroundControl's format; .parm: MAVProxy's
  darko-gcs param load mine.params        sets what differs, and tells what is refused
  darko-gcs param diff mine.params        what differs from a file
  darko-gcs param diff                    what differs from the vehicle's defaults

{EXIT_CODES}"""
PARAMETER_ACTIONS = {"list": (0,), "get": (1,), "set": (2,), "save": (1,), "load": (1,), "diff": (0, 1)}
NOT_THERE = "the vehicle has no such parameter"

Metadata = dict[str, "ParameterMetadata"]


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs param``."""
    parser = command_parser("darko-gcs param", commands, _EXAMPLES)
    add_actions(parser, PARAMETER_ACTIONS, "a name, a name and a value, or a file")
    return parser


def run(args: argparse.Namespace) -> int:
    """Read or change parameters and print the result.

    Raises:
        GroundError: The vehicle refused or did not answer, or an argument is wrong.
    """
    from darko_gcs.errors import GroundError
    from protocol.errors import FileError

    check_values(args, "param", PARAMETER_ACTIONS, "value")
    try:
        job = _job(args.action, args.values)
    except FileError as error:
        raise GroundError(str(error)) from error
    described: Metadata = {}
    if not args.json and args.action != "save":
        job = _with_names(job, described)
    return run_script(args, job, lambda result: _words(result, described))


def _job(action: str, values: list[str]) -> Job:
    """The job of an action; what can be checked without a vehicle is checked first."""
    from protocol.plans.parameter_files import load_parameters

    if action == "set":
        return lambda vehicle: _set(vehicle, values[0], values[1])
    if values and action in {"load", "diff"}:
        wanted = load_parameters(Path(values[0]))
        return lambda vehicle: _compare(vehicle, wanted, change=action == "load")
    if action == "diff":
        return _compare_with_defaults
    if action == "save":
        return lambda vehicle: _save(vehicle, Path(values[0]))
    return lambda vehicle: _read(vehicle, values[0] if values else None)


def _with_names(job: Job, described: Metadata) -> Job:
    """The same job, which also asks what the values mean: for people."""

    async def run(vehicle: Vehicle) -> Result:
        result = await job(vehicle)
        described.update(await vehicle.parameter_metadata())
        return result

    return run


async def _read(vehicle: Vehicle, name: str | None) -> Result:
    known = await vehicle.parameters()
    if name is None:
        return {"parameters": known}
    _require(known, name)
    return {"parameters": {name: known[name]}}


async def _set(vehicle: Vehicle, name: str, text: str) -> Result:
    from darko_gcs.errors import FlightError, GroundError
    from darko_gcs.state.parameters import NO_METADATA

    _require(await vehicle.parameters(), name)
    metadata = NO_METADATA
    try:
        try:
            value = metadata.value_of(text)
        except ValueError:  # no number: the vehicle knows names
            metadata = (await vehicle.parameter_metadata()).get(name, NO_METADATA)
            value = metadata.value_of(text)
    except ValueError as error:
        raise GroundError(f"param set {name}: {error}") from None
    try:
        return {"parameters": {name: await vehicle.set_parameter(name, value)}}
    except FlightError as error:
        error.details |= {"parameter": name, "value": value, **await _limits(vehicle, name)}
        raise


async def _limits(vehicle: Vehicle, name: str) -> Result:
    """The range of a parameter, as far as the vehicle describes it."""
    from darko_gcs.state.parameters import NO_METADATA

    metadata = (await vehicle.parameter_metadata()).get(name, NO_METADATA)
    return (
        {"limit": {"min": metadata.minimum, "max": metadata.maximum, "unit": metadata.unit}} if metadata.bounds else {}
    )


async def _compare(vehicle: Vehicle, file: ParameterFile, *, change: bool) -> Result:
    from darko_gcs.state.parameters import differences

    wanted, left_out = file.of(vehicle.source), file.left_out(vehicle.source)
    await vehicle.parameters()
    differ = differences(vehicle.now, wanted)
    result: Result = {"differ": {each.name: {"vehicle": each.vehicle, "file": each.other} for each in differ}}
    if left_out:
        result["left_out"] = [
            {"name": row.name, "value": row.value, "system": row.owner[0], "component": row.owner[1]}
            for row in left_out
            if row.owner is not None
        ]
    if change:
        await _load(vehicle, result, {each.name: each.other for each in differ})
    return result


async def _load(vehicle: Vehicle, result: Result, wanted: Mapping[str, float]) -> None:
    """Set what differs; adds to the result what is set and what is refused, with the reason."""
    from darko_gcs.state.parameters import refused_changes

    changes = await vehicle.set_parameters({name: value for name, value in wanted.items() if name in _known(vehicle)})
    refused = {
        name: {"value": change.value, "reason": change.reason, **await _limits(vehicle, name)}
        for name, change in refused_changes(changes).items()
    }
    missing = {name: {"value": value, "reason": NOT_THERE} for name, value in wanted.items() if name not in changes}
    result["parameters"] = {name: vehicle.now.parameters.values[name] for name in changes if name not in refused}
    if refused := missing | refused:
        result["refused"] = refused
        result["error"] = f"{len(refused)} of {len(wanted)} parameters refused: {', '.join(sorted(refused)[:5])}"


def _known(vehicle: Vehicle) -> Mapping[str, float]:
    return vehicle.now.parameters.values


async def _compare_with_defaults(vehicle: Vehicle) -> Result:
    from darko_gcs.errors import FlightError
    from darko_gcs.state.parameters import default_differences

    await vehicle.parameters()
    if not await vehicle.parameter_metadata():
        raise FlightError("the vehicle does not report the defaults of its parameters")
    differ = default_differences(vehicle.now)
    return {"differ": {each.name: {"vehicle": each.vehicle, "default": each.other} for each in differ}}


async def _save(vehicle: Vehicle, path: Path) -> Result:
    from protocol.plans.parameter_files import save_parameters

    known = await vehicle.parameters()
    save_parameters(path, known, vehicle.parameter_types(), vehicle.source)
    return {"file": str(path), "saved": len(known)}


def _require(known: Mapping[str, float], name: str) -> None:
    from darko_gcs.errors import FlightError

    if name not in known:
        raise FlightError(f"the vehicle has no parameter {name}")


def _words(result: Result, described: Metadata) -> str:
    from darko_gcs.state.parameters import NO_METADATA

    def shown(name: str, value: float) -> str:
        metadata = described.get(name, NO_METADATA)
        unit = f" {metadata.unit}" if metadata.unit else ""
        return metadata.shown(value) + unit

    if "saved" in result:
        return f"{result['file']}: {result['saved']} parameters"
    if "parameters" in result:
        lines = [f"{name:<16} {shown(name, value)}" for name, value in result["parameters"].items()]
        refused = result.get("refused", {}).items()
        lines += [f"{name:<16} {shown(name, row['value'])} refused: {row['reason']}" for name, row in refused]
    else:
        lines = [_difference(name, both, shown) for name, both in result["differ"].items()]
    return "\n".join([*(lines or ["nothing differs"]), *_left_out(result)])


def _left_out(result: Result) -> list[str]:
    """Rows of a file that are other components', a line for each component."""
    names: dict[str, list[str]] = {}
    for row in result.get("left_out", ()):
        names.setdefault(f"{row['system']}/{row['component']}", []).append(row["name"])
    return [f"left out, of component {owner}: {', '.join(found)}" for owner, found in names.items()]


def _difference(name: str, both: Mapping[str, float | None], shown: Callable[[str, float], str]) -> str:
    here, other = both["vehicle"], "file" if "file" in both else "default"
    on_vehicle = "missing" if here is None else shown(name, here)
    value = both[other]
    elsewhere = "" if value is None else shown(name, value)
    where = "in the file" if other == "file" else "by default"
    return f"{name:<16} {on_vehicle} on the vehicle, {elsewhere} {where}"
