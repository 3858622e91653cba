"""Waypoints in forward flight: miss distances, the places where they count as reached, and mission times.

python scripts/bench/waypoints.py [--wind SPEED --direction DEGREES --gusts RMS] [MISSION ...]
"""

from __future__ import annotations

import argparse
import math

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.names import Mode
from protocol.plans.plan import MissionItem
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.model.airframe_files import load
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS, Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings

LIMIT = 900.0  # of a mission [s]
TICK = 0.02  # of the autopilot [s]
Place = tuple[float, float, float]  # north, east and up [m]

SURVEY = [
    (200.0 * north, 30.0 * line, 30.0) for line in range(6) for north in ((0.0, 1.0) if line % 2 == 0 else (1.0, 0.0))
]
MISSIONS: dict[str, list[Place]] = {
    "square": [(200, 0, 30), (200, 200, 30), (0, 200, 30), (0, 0, 30)],
    "reversal": [(250, 0, 30), (0, 1, 30), (250, 2, 30)],
    "sharp": [(250, 0, 30), (50, 120, 30), (250, 240, 30), (400, 240, 30)],
    "steep climb": [(100, 0, 30), (200, 0, 110), (400, 0, 110)],
    "steep descent": [(150, 0, 100), (400, 0, 15), (600, 0, 15)],
    "survey": SURVEY,
}


def waypoint(place: Place) -> MissionItem:
    """A waypoint north, east and up of home [m]."""
    north, east, up = place
    return MissionItem(
        command=mavlink.MAV_CMD_NAV_WAYPOINT,
        frame=mavlink.MAV_FRAME_LOCAL_NED,
        params=(0.0, 0.0, 0.0, math.nan),
        x=round(north * 1e4),
        y=round(east * 1e4),
        z=-up,
    )


def fly(places: list[Place], world: WorldSettings) -> tuple[float, list[tuple[float, float]]]:
    """Fly a mission from a hover at 3 m: how long it took [s], and how far level and in height each was told [m]."""
    vehicle = Simulation(load("nominal").parameters, start=Start(up=3.0, airborne=True), navigation=Navigation.TRUTH)
    configuration = Configuration(Settings(), Tuning(), world)
    aircraft = Aircraft(vehicle, World(LocalFrame(HOME), ARENAS["open"]), configuration, airborne=True)
    autopilot = aircraft.autopilot
    aircraft.advance(AUTOPILOT_PERIODS)
    autopilot.missions.load(tuple(map(waypoint, places)))
    autopilot.missions.start()
    told: list[tuple[float, float]] = []
    begun = aircraft.vehicle.time
    while autopilot.mode is Mode.MISSION and aircraft.vehicle.time - begun < LIMIT:
        aircraft.advance(AUTOPILOT_PERIODS)
        north, west, up = autopilot.view.p
        for seq in autopilot.reached():
            there = places[seq]
            told.append((math.hypot(north - there[0], -west - there[1]), up - there[2]))
    return aircraft.vehicle.time - begun, told


def main() -> None:
    """Print a line for each mission."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("missions", nargs="*", metavar="MISSION", help=", ".join(MISSIONS))
    parser.add_argument("--wind", type=float, default=0.0, help="[m/s]")
    parser.add_argument("--direction", type=float, default=0.0, help="where it comes from [deg]")
    parser.add_argument("--gusts", type=float, default=0.0, help="rms per axis [m/s]")
    options = parser.parse_args()
    world = WorldSettings()._replace(wind_speed=options.wind, wind_direction=options.direction, gusts=options.gusts)
    for name in options.missions or MISSIONS:
        seconds, told = fly(MISSIONS[name], world)
        passed = " ".join(f"{level:.0f}/{height:+.0f}" for level, height in told)
        print(f"{name:14s} {seconds:6.1f} s, reached level/height [m]: {passed}", flush=True)


if __name__ == "__main__":
    main()
