"""``darko-gcs param``: the vehicle's parameters, from a script."""

from __future__ import annotations

import argparse
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from darko_gcs.commands.script_options import EXIT_CODES, add_script_options, run_script

if TYPE_CHECKING:
    from darko_gcs.scripting import Vehicle

__all__ = ["parser", "run"]

_EXAMPLES = f"""\
examples:
  darko-gcs param list
  darko-gcs param get DRK_HOV_VMAX
  darko-gcs param set DRK_HOV_VMAX 2
  darko-gcs param save mine.params        QGroundControl's format; .parm: MAVProxy's
  darko-gcs param load mine.params        sets what differs
  darko-gcs param diff mine.params

{EXIT_CODES}"""
PARAM_WORDS = {"list": 0, "get": 1, "set": 2, "save": 1, "load": 1, "diff": 1}


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs param``."""
    parser = argparse.ArgumentParser(
        prog="darko-gcs param",
        description=commands["param"] + ".",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("action", choices=list(PARAM_WORDS), help="what to do")
    parser.add_argument("values", nargs="*", help="a name, a name and a value, or a file")
    add_script_options(parser)
    return parser


def run(args: argparse.Namespace) -> int:
    """Read or change parameters and print the result.

    Raises:
        GroundError: The vehicle refused or did not answer, or an argument is wrong.
    """
    from darko_gcs.errors import GroundError  # noqa: PLC0415 - --help must be quick
    from protocol.errors import FileError  # noqa: PLC0415

    wanted = PARAM_WORDS[args.action]
    if len(args.values) != wanted:
        raise GroundError(f"param {args.action} takes {wanted} value{'s' * (wanted != 1)}, not {len(args.values)}")
    try:
        job = _job(args.action, args.values)
    except FileError as error:
        raise GroundError(str(error)) from error
    return run_script(args, job, _words)


def _job(action: str, values: list[str]) -> Callable[[Vehicle], Awaitable[dict[str, Any]]]:
    """The job of an action; what can be checked without a vehicle is checked first."""
    from darko_gcs.errors import GroundError  # noqa: PLC0415 - --help must be quick
    from protocol.plans.parameter_files import load_parameters  # noqa: PLC0415

    if action == "set":
        try:
            number = float(values[1])
        except ValueError:
            raise GroundError(f"param set {values[0]}: {values[1]} is not a number") from None
        return lambda vehicle: _set(vehicle, {values[0]: number})
    if action in {"load", "diff"}:
        wanted = load_parameters(Path(values[0]))
        return lambda vehicle: _compare(vehicle, wanted, change=action == "load")
    if action == "save":
        return lambda vehicle: _save(vehicle, Path(values[0]))
    return lambda vehicle: _read(vehicle, values[0] if values else None)


async def _read(vehicle: Vehicle, name: str | None) -> dict[str, Any]:
    known = await vehicle.parameters()
    if name is None:
        return {"parameters": known}
    _require(known, [name])
    return {"parameters": {name: known[name]}}


async def _set(vehicle: Vehicle, wanted: Mapping[str, float]) -> dict[str, Any]:
    _require(await vehicle.parameters(), wanted)
    return {"parameters": {name: await vehicle.set_parameter(name, value) for name, value in wanted.items()}}


async def _compare(vehicle: Vehicle, wanted: Mapping[str, float], *, change: bool) -> dict[str, Any]:
    known = await vehicle.parameters()
    _require(known, wanted)
    differ = {name: value for name, value in wanted.items() if abs(known[name] - value) > 1e-6 * abs(value)}
    result: dict[str, Any] = {"differ": {name: {"vehicle": known[name], "file": differ[name]} for name in differ}}
    if change:
        result["parameters"] = {name: await vehicle.set_parameter(name, value) for name, value in differ.items()}
    return result


async def _save(vehicle: Vehicle, path: Path) -> dict[str, Any]:
    from protocol.atomic_write import write_atomically  # noqa: PLC0415 - --help must be quick
    from protocol.plans.parameter_files import render_parm, render_qgc_params  # noqa: PLC0415

    known = await vehicle.parameters()
    if path.suffix == ".parm":
        text = render_parm(known)
    else:
        system, component = vehicle.source
        text = render_qgc_params(known, vehicle.parameter_types(), system, component)
    write_atomically(path, text.encode())
    return {"file": str(path), "saved": len(known)}


def _require(known: Mapping[str, float], names: Mapping[str, float] | list[str]) -> None:
    from darko_gcs.errors import FlightError  # noqa: PLC0415 - --help must be quick

    missing = [name for name in names if name not in known]
    if missing:
        raise FlightError(f"the vehicle has no parameter {', '.join(missing[:5])}")


def _words(result: dict[str, Any]) -> str:
    if "saved" in result:
        return f"{result['file']}: {result['saved']} parameters"
    lines = [f"{name:<16} {value:g}" for name, value in result.get("parameters", {}).items()]
    if "differ" in result and "parameters" not in result:
        lines = [f"{name:<16} {both['vehicle']:g} on the vehicle, {both['file']:g} in the file"
                 for name, both in result["differ"].items()]  # fmt: skip
    return "\n".join(lines) or "nothing differs"
