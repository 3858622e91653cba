"""Flights by an export in floats beside the same ones in doubles, in the simulator's loop: do they end alike?

``python -m scripts.bench.export_floats DIR``, from the project's folder, of what ``darko-sitl export c DIR --float32``
wrote for the shipped airframe: hovers that move on and legs, by turns, in wind and gusts. With ``--estimator sensors``
in the export they fly on sensors.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

from protocol.dialect.vocabulary import Law
from sitl.control.reference import along, hover_at, leg
from sitl.export.build import ESTIMATOR_SOURCES
from sitl.export.in_the_loop import ExportedRegister
from sitl.model.airframe import Array
from sitl.model.airframe_files import load
from sitl.simulation.avionics import Navigation
from sitl.simulation.dispatch import REGISTER, Register
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start

UP = 60.0  # where flights begin [m]


class Flown(NamedTuple):
    """One flight."""

    places: Array  # fifty times a second, (n, 3) [m]
    jumps: list[tuple[float, int]]  # times and targets
    law: int  # in force at the end
    has_crashed: bool


def fly(number: int, seconds: float, navigation: Navigation, register: Register) -> Flown:
    """Fly a hover that moves on, or a leg; arguments as of the command."""
    rng = np.random.default_rng([number, 37])
    heading = float(rng.uniform(-3.0, 3.0))
    start = Start(up=UP, heading=heading, airborne=True)
    made = Simulation(load("darko").parameters, seed=number, start=start, register=register, navigation=navigation)
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    made.set_wind(rng.normal(0.0, (2.5, 2.5, 0.2)), float(rng.uniform(0.0, 0.8)))
    x, y = rng.normal(0.0, 10.0, 2)
    up = UP + float(rng.uniform(-3.0, 3.0))
    if number % 2:
        course, length = rng.uniform(-math.pi, math.pi), rng.uniform(60.0, 150.0)
        x, y = length * math.cos(course), length * math.sin(course)
    hover = hover_at((float(x), float(y), up), heading)
    path = leg((0.0, 0.0, UP), hover.position, float(rng.uniform(12.0, 18.0)))
    made.reference = along(hover, path, heading) if number % 2 else hover
    recording = made.record(seconds)
    jumps = [(jump.time, int(jump.target)) for jump in made.jumps]
    places = np.vstack([recording.position, np.array([made.truth.body.position])])
    return Flown(places, jumps, int(made.law), made.crash is not None)


def compare(register: Register, flights: int, seconds: float, navigation: Navigation) -> None:
    """Print how far flights in floats are from those in doubles."""
    apart, ends, moved = [], [], []
    for number in range(1, flights + 1):
        ours, theirs = (fly(number, seconds, navigation, one) for one in (REGISTER, register))
        distance = np.linalg.norm(theirs.places - ours.places, axis=1)
        apart.append(distance.max())
        ends.append(distance[-1])
        same = [jump for _, jump in ours.jumps] == [jump for _, jump in theirs.jumps]
        late = max((abs(a - b) for (a, _), (b, _) in zip(ours.jumps, theirs.jumps, strict=same)), default=0.0)
        moved.append(late if same else math.inf)
        words = f"at most {late:.3f} s apart" if same else f"{len(theirs.jumps)} in floats"
        lost = ", LOST" if theirs.has_crashed or theirs.law != ours.law else ""
        far = f"{distance.max():.2e} m apart, {distance[-1]:.2e} m at the end{lost}"
        print(f"{number}: {len(ours.jumps)} jumps, {words}; {far}", flush=True)
    print(f"{sum(map(math.isfinite, moved))} of {flights} with the same jumps, at most {max(moved):.3f} s apart")
    for name, values in (("on the way", apart), ("at the end", ends)):
        print(f"{name}: at most {max(values):.2e} m apart, {np.median(values):.2e} m in half of the flights")


def main() -> int:
    """Fly and print."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("folder", type=Path, metavar="DIR")
    options.add_argument("--flights", type=int, default=20, metavar="N", help="[%(default)s]")
    options.add_argument("--seconds", type=float, default=30.0, metavar="S", help="of each [%(default)s]")
    args = options.parse_args()
    register = ExportedRegister(args.folder)
    has_estimator = (args.folder / ESTIMATOR_SOURCES[0]).is_file()
    compare(register, args.flights, args.seconds, Navigation.SENSORS if has_estimator else Navigation.TRUTH)
    return 0


if __name__ == "__main__":
    sys.exit(main())
