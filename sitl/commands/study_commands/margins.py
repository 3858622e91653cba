"""Robustness of the laws to delay and noise of the estimate: flights from many seeds."""

from __future__ import annotations

import argparse

from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    write_json,
)
from sitl.lab.studies import margins
from sitl.lab.studies.margins import MarginDraw

SURVIVED_DELAY = 0.04  # from sensor to actuator, that everything converges with at the specified noise [s]


def run(args: argparse.Namespace) -> int:
    """Fly the map and print it; exit code 1 if a delay of 40 ms is not survived at the specified noise."""
    limits = {name: most for name, most in (("delay", 0.1), ("noise", 100.0)) if getattr(args, name) is not None}
    check_seeded(args, limits)

    seeds = range(args.first, args.first + args.flights)
    draws = margins.grid(seeds, args.delay or margins.DELAYS, args.noise or margins.NOISE_FACTORS, args.controller)
    flown = margins.run(draws, craft_of(args), args.jobs, lambda done: print_progress(done, len(draws)))
    print("\n".join(margins.summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [flight._asdict() | {"draw": _plain(flight.draw)} for flight in flown])
    needed = [flight for flight in flown if flight.draw.delay <= SURVIVED_DELAY and flight.draw.noise <= 1.0]
    return 0 if all(flight.converged for flight in needed) else 1


def _plain(draw: MarginDraw) -> dict[str, object]:
    return draw._asdict() | {"manoeuvre": draw.manoeuvre.value}
