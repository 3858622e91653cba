"""Airframe parameter sets: list them, show one, or print and draw its trims."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import finite_number
from sitl.errors import SitlError
from sitl.tools.plotting import check_plot_path

if TYPE_CHECKING:
    from sitl.model.airframe import Airframe

LISTED_SPEEDS = range(26)  # [m/s]


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl airframe``."""
    options = CommandParser(prog="darko-sitl airframe", description=commands["airframe"] + ".")
    options.add_argument("name", nargs="?", help="a shipped set or a TOML file; without a name the sets are listed")
    options.add_argument("--trims", action="store_true", help="print trims from 0 to 25 m/s, with their margins")
    options.add_argument(
        "--climb", type=finite_number, metavar="DEG", help="with --trims: climb angle (negative: descent) [0]"
    )
    turn = options.add_mutually_exclusive_group()
    turn.add_argument("--turn", type=finite_number, metavar="DEG/S", help="with --trims: turn rate to the left [0]")
    turn.add_argument("--bank", type=finite_number, metavar="DEG", help="with --trims: bank of a left turn")
    options.add_argument(
        "--plot",
        type=Path,
        metavar="FILE",
        help="with --trims: also draw climbs, turns and braking: .png, .svg or .pdf",
    )
    return options


def run(args: argparse.Namespace) -> int:
    """List the shipped sets, or check and show one."""
    from sitl.model.airframe_files import available, load  # noqa: PLC0415 - --help must not load the compiler

    _check(args)
    if args.name is None:
        for name in available():
            print(f"{name:<22}{load(name).description}")
        return 0
    airframe = load(args.name)
    if args.trims:
        print("\n".join(_trims(airframe.parameters, args)))
        if args.plot is not None:
            from sitl.lab.studies.trim_plot import save_trims_plot  # noqa: PLC0415 - matplotlib is slow to load

            save_trims_plot(airframe.name, airframe.parameters, args.plot)
        return 0
    print(f"{airframe.name}: {airframe.description}\n{airframe.path} sha256 {airframe.sha256}")
    for key, entry in airframe.values.items():
        print(f"  {key:<16}{entry.value!s:>14} {entry.unit:<10} {entry.source}")
    return 0


def _check(args: argparse.Namespace) -> None:
    """Refuse angles out of range, and options of --trims without it."""
    for option, limit in (("climb", 80.0), ("turn", 180.0), ("bank", 80.0)):
        value = getattr(args, option)
        if value is not None and not abs(value) <= limit:
            raise SitlError(f"--{option} {value:g} is not within -{limit:g} to {limit:g}")
    chosen = [option for option in ("climb", "turn", "bank", "plot") if getattr(args, option) is not None]
    if chosen and not (args.trims and args.name is not None):
        raise SitlError(f"--{chosen[0]} needs a parameter set and --trims")
    if args.plot is not None:
        check_plot_path(args.plot)


def _trims(a: Airframe, args: argparse.Namespace) -> Iterator[str]:
    climb = math.radians(args.climb or 0.0)
    if args.turn is None and args.bank is None:
        return _straight(a, climb)
    return _turning(a, climb, args.turn, args.bank)


def _straight(a: Airframe, climb: float) -> Iterator[str]:
    from sitl.design.trim import level_trim  # noqa: PLC0415 - --help must not load the compiler
    from sitl.lab.studies.trim_plot import cost  # noqa: PLC0415 - the same

    yield "V [m/s]  nose [deg]  thrust [N]  elevon [deg]  motor [rad/s]  elevon margin [deg]  [J/m]"
    for speed in LISTED_SPEEDS:
        trim = level_trim(a, float(speed), climb)
        numbers = (
            f"{math.degrees(trim.theta):12.1f}{trim.thrust:12.3f}{math.degrees(trim.delta):14.1f}{trim.omega:15.0f}"
        )
        missing = "" if trim.exists else "   no trim within the limits"
        yield f"{speed:7d}{numbers}{math.degrees(trim.margin):21.1f}{cost(a, trim):7.2f}{missing}"


def _turning(a: Airframe, climb: float, turn: float | None, bank: float | None) -> Iterator[str]:
    from sitl.design.turn import banked_trim, turning_trim  # noqa: PLC0415 - --help must not load the compiler
    from sitl.lab.studies.trim_plot import cost  # noqa: PLC0415 - the same

    yield ("V [m/s]  turn [deg/s]  bank [deg]  nose [deg]  elevons [deg]  motors [rad/s]  elevon margin [deg]  [J/m]")
    for speed in LISTED_SPEEDS:
        if bank is None:
            trim = turning_trim(a, float(speed), math.radians(turn or 0.0), climb)
        elif speed == 0:
            continue  # at rest a bank does not turn
        else:
            trim = banked_trim(a, float(speed), math.radians(bank), climb)
        if math.isnan(trim.margin):
            yield f"{speed:7d}   no trim: the propellers would have to push, or no elevon angle balances"
            continue
        path = f"{math.degrees(trim.turn_rate):14.1f}{math.degrees(trim.bank):12.1f}{math.degrees(trim.theta):12.1f}"
        left, right = (math.degrees(delta) for delta in trim.delta)
        actuators = f"{left:9.1f}{right:6.1f}{trim.omega[0]:10.0f}{trim.omega[1]:6.0f}{math.degrees(trim.margin):21.1f}"
        missing = "" if trim.exists else "   no trim within the limits"
        yield f"{speed:7d}{path}{actuators}{cost(a, trim):7.2f}{missing}"
