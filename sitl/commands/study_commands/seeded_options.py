"""Common parts of the commands that fly many seeds: arguments, progress lines and files of results."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import whole_number
from sitl.defaults import AIRFRAME
from sitl.errors import SitlError

if TYPE_CHECKING:
    from sitl.lab.studies.craft import Craft

PROGRESS_INTERVAL = 10  # flights between two progress lines


def seeded_parser(name: str, description: str, flights: int | None, flown: str) -> argparse.ArgumentParser:
    """A command line with the arguments that all of them have.

    Args:
        name: The command.
        description: What it does.
        flights: How many are flown by default; None: the command itself decides.
        flown: What ``--flights`` counts.
    """
    options = CommandParser(prog=f"darko-sitl {name}", description=f"{description}.")
    many = flown if flights is None else f"{flown} [{flights}]"
    options.add_argument("--flights", type=whole_number, default=flights, metavar="N", help=many)
    options.add_argument("--first", type=whole_number, default=1, metavar="SEED", help="seed of the first [1]")
    options.add_argument("--jobs", type=whole_number, default=2, metavar="N", help="processes at once [2]")
    options.add_argument("--airframe", default=AIRFRAME, metavar="SET", help=f"parameter set or TOML file [{AIRFRAME}]")
    options.add_argument(
        "--nav", default="sensors", choices=("sensors", "mocap", "truth"), help="what it navigates by [sensors]"
    )
    options.add_argument("--controller", default="hybrid", choices=("hybrid", "indi"), help="what flies it [hybrid]")
    options.add_argument("--sensors", metavar="FILE", help="TOML file that overrides specifications of instruments")
    options.add_argument("--json", type=Path, metavar="FILE", help="also write every flight as JSON")
    return options


def craft_of(args: argparse.Namespace) -> Craft:
    """The craft that the arguments of a :func:`seeded_parser` choose.

    Raises:
        SitlError: If there is no such airframe, or a file is not valid.
    """
    from sitl.lab.studies.craft import Craft  # noqa: PLC0415
    from sitl.sensors.sensor_files import load_sensors  # noqa: PLC0415 - --help must not load the compiler
    from sitl.simulation.avionics import Navigation  # noqa: PLC0415

    load_sensors(args.sensors)
    return Craft(args.airframe, Navigation(args.nav), args.sensors, args.controller)


def check_seeded(args: argparse.Namespace, limits: Mapping[str, float], counts: Sequence[str] = ()) -> None:
    """Refuse bad arguments before any flight.

    Args:
        args: Of a :func:`seeded_parser`.
        limits: Greatest value of each argument that must not be negative; it may have several values.
        counts: Further arguments that must be at least 1.

    Raises:
        SitlError: Names the argument and its value, or the folder that is missing.
    """
    for name in ("flights", "jobs", *counts):
        if getattr(args, name) < 1:
            raise SitlError(f"--{name} {getattr(args, name)}: there must be at least 1")
    if args.first < 0:
        raise SitlError(f"--first {args.first}: seeds are not negative")
    for name, maximum in limits.items():
        given = getattr(args, name)
        for value in given if isinstance(given, list) else [given]:
            if not 0.0 <= value <= maximum:
                raise SitlError(f"--{name} {value:g} is not within 0 and {maximum:g}")
    if args.json is not None and not args.json.parent.is_dir():
        raise SitlError(f"{args.json}: there is no folder {args.json.parent}")


def print_progress(done: int, of: int) -> None:
    """A line on the standard error now and then, and at the end."""
    if done % PROGRESS_INTERVAL == 0 or done == of:
        print(f"{done}/{of} flown", file=sys.stderr, flush=True)


def write_json(path: Path, written: object) -> None:
    """Write results as JSON.

    Raises:
        SitlError: The file cannot be written.
    """
    try:
        path.write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise SitlError(f"{path}: {error.strerror}") from error
