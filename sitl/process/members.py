"""The arguments of each vehicle of a fleet: those of the command line, with its own ids, start, seed and folder."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

from sitl.errors import SitlError

LAST_SYSTEM = 254  # 255 is the ground station's usual id


def member_arguments(args: argparse.Namespace, state_dir: Path) -> list[argparse.Namespace]:
    """The arguments of the vehicles, in the order of their system ids.

    They stand on a square grid: the first at ``--start``, the next ones east of it, then the next row north. Vehicle k
    of a fleet (from 0) has the seed ``--seed`` + k, and keeps parameters, plans and logs in a folder of its own.

    Args:
        args: Of ``darko-sitl run``, with ``vehicles``.
        state_dir: Under which their folders are.

    Raises:
        SitlError: An option cannot be combined with several vehicles, or there are too few system ids.
    """
    _refuse_what_one_flies_alone(args)
    last = args.sysid + args.vehicles - 1
    if last > LAST_SYSTEM:
        raise SitlError(f"--vehicles {args.vehicles}: system ids {args.sysid} to {last} would go beyond {LAST_SYSTEM}")
    north, east, up, yaw = args.start or (0.0, 0.0, 0.0, 0.0)
    return [
        argparse.Namespace(
            **vars(args)
            | {
                "sysid": args.sysid + k,
                "forwards": k == 0,  # more than one would multiply what they forward
                "seed": args.seed + k,
                "start": (north + row * args.spacing, east + column * args.spacing, up, yaw),
                "state_dir": state_dir / f"vehicle-{args.sysid + k}",
            }
        )
        for k, (row, column) in enumerate(grid(args.vehicles))
    ]


def grid(count: int) -> Sequence[tuple[int, int]]:
    """Row and column of each place in a grid that is as square as can be."""
    columns = math.isqrt(count - 1) + 1
    return [divmod(place, columns) for place in range(count)]


def _refuse_what_one_flies_alone(args: argparse.Namespace) -> None:
    alone = {
        "--scenario": (args.scenario, "an experiment is of one vehicle"),
        "--day": (args.day, "a day is of one vehicle"),
        "--flight-plan": (args.flight_plan, "every vehicle would fly to the same points; upload one to each instead"),
        "--speed 0": (args.speed == 0.0 or None, "several vehicles keep step by the clock"),
    }
    for option, (value, reason) in alone.items():
        if value is not None:
            raise SitlError(f"{option}: not with --vehicles {args.vehicles}: {reason}")
