"""How fast the vehicle flies headless, on one core, beside a plant-only loop in the same run.

``python scripts/bench/sim.py [--runs N]`` prints, as medians over the runs: the scenario runner (laws, supervisor,
recording at 50 Hz) in times real time, and its cost as a multiple of the bare compiled plant.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np
from numba import njit

from sitl.airframe import load
from sitl.kernels.integrate import plant_step
from sitl.model.airframe import Airframe, Array
from sitl.studies.report import SCENARIOS
from sitl.studies.scenario import fly
from sitl.vehicle import Start, Vehicle

STEP = 1e-3
SECONDS = 200.0


@njit()
def plant_only(plant: Array, command: Array, wind: Array, airframe: Airframe, steps: int) -> None:
    """The plant without a law, all steps in one call."""
    for _ in range(steps):
        plant_step(plant, command, wind, True, airframe, STEP)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=7)
    runs = parser.parse_args().runs
    vehicle = Vehicle(load("nominal").parameters, start=Start(up=1000.0, airborne=True))
    command, wind = np.array((687.0, 687.0, 0.0, 0.0)), np.zeros(3)
    plant_only(vehicle.plant, command, wind, vehicle.airframe, 1)
    scenario = SCENARIOS["far-target"]
    whole, bare = [], []
    for _ in range(runs):
        began = time.perf_counter()
        plant_only(vehicle.plant, command, wind, vehicle.airframe, round(SECONDS / STEP))
        bare.append(SECONDS / (time.perf_counter() - began))
        vehicle.begin(Start(up=1000.0, airborne=True))
        whole.append(scenario.duration / fly(scenario).wall)
    ratio = statistics.median(b / w for b, w in zip(bare, whole, strict=True))
    speed, plant = statistics.median(whole), statistics.median(bare)
    print(f"scenario runner: {speed:.0f}x real time (median of {runs}, {min(whole):.0f}..{max(whole):.0f})")
    print(f"plant alone:     {plant:.0f}x real time ({plant / STEP / 1e6:.2f} M steps/s)")
    print(f"ratio:           {ratio:.1f}")


if __name__ == "__main__":
    main()
