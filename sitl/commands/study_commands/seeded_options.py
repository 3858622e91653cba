"""Common parts of the studies that fly many seeds: the craft, checks, progress lines and files of results."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from sitl.errors import SitlError
from sitl.lab.studies.craft import Craft
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.avionics import Navigation

PROGRESS_INTERVAL = 10  # flights between two progress lines


def craft_of(args: argparse.Namespace) -> Craft:
    """The craft that the arguments of a seeded study choose.

    Raises:
        SitlError: If there is no such airframe, or a file is not valid.
    """
    load_sensors(args.sensors)
    return Craft(args.airframe, Navigation(args.nav), args.sensors, args.controller)


def check_seeded(args: argparse.Namespace, limits: Mapping[str, float], counts: Sequence[str] = ()) -> None:
    """Refuse bad arguments before any flight.

    Args:
        args: Of a seeded study.
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
