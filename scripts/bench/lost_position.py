"""Hovers whose satellites are lost: how far away the vehicle lands, and whether it stands.

Run by hand: ``python scripts/bench/lost_position.py``; it prints the table of docs/failsafes.md.
"""

from __future__ import annotations

import math
from statistics import median

from protocol.frames import LocalFrame
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME, STUDY_AIRFRAME
from sitl.model.airframe_files import load
from sitl.sensors.instruments import GNSS, OFF
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings

SEEDS = range(1, 7)
WINDS = ((0.0, 0.0), (2.0, 0.0), (4.0, 0.7), (7.0, 1.0))  # and gusts, rms [m/s]
HOVERS = ((5.0, 6.0), (10.0, 15.0))  # height [m], and how long it hovers before [s]
WIND_FROM = 40.0  # [deg]
LIMIT = 60.0  # for the landing [s]


def land(seed: int, wind: float, gusts: float, height: float, hover: float) -> tuple[float, bool]:
    """Distance between the loss of satellites and the landing [m], and whether the vehicle stands."""
    start = Start(up=height, airborne=True)
    vehicle = Simulation(load(STUDY_AIRFRAME).parameters, seed=seed, start=start, navigation=Navigation.SENSORS)
    air = WorldSettings(wind_speed=wind, wind_direction=WIND_FROM, gusts=gusts)
    world = World(LocalFrame(HOME), ARENAS["open"])
    aircraft = Aircraft(vehicle, world, Configuration(Settings(), Tuning(), air), airborne=True)
    aircraft.advance(round(500 * hover))
    vehicle.avionics.instruments.failures[GNSS] = OFF
    lost, end = vehicle.truth.body.position, vehicle.time + LIMIT
    while aircraft.autopilot.armed and vehicle.time < end:
        aircraft.advance(50)
    place = vehicle.truth.body.position
    stands = aircraft.autopilot.notices()[-1].text == "Disarmed after landing"
    return math.hypot(place.x - lost.x, place.y - lost.y), stands


def main() -> None:
    """Print the table."""
    heads = (f"at {height:g} m: median | farthest | standing" for height, _ in HOVERS)
    print("| Wind, gusts (rms) [m/s] | " + " | ".join(heads) + " |")
    for wind, gusts in WINDS:
        cells = []
        for height, hover in HOVERS:
            distances, stand = zip(*(land(seed, wind, gusts, height, hover) for seed in SEEDS), strict=True)
            cells.append(f"{median(distances):.1f} | {max(distances):.1f} | {sum(stand)}")
        print(f"| {wind:g}, {gusts:g} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
