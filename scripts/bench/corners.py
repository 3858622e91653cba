"""Legs flown forward after a corner: time and energy as flown beside their predictions, on the truth.

python scripts/bench/corners.py [--airframe NAME] [--wind SPEED --direction DEGREES]
"""

from __future__ import annotations

import argparse
import itertools
import math
from typing import NamedTuple

from protocol.dialect.vocabulary import LegMode
from sitl.autopilot.settings import Settings
from sitl.defaults import AIRFRAME, BRISK, GENTLE
from sitl.lab.studies.seeded_flights import STUDY_WORLD, has_finished_mission, waypoint
from sitl.model.airframe_files import load
from sitl.prediction.point_mass import Prediction
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS, Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings

HEIGHT, RUN_UP, RUN_OUT = 45.0, 150.0, 100.0  # of the legs; before the corner, and straight on after the leg [m]
SETTLED = 4000  # control periods in the hover before it begins
CORNERS = (0, 30, 60, 90, 120, 150, 170)  # [deg]
LENGTHS = (40.0, 100.0)  # of the leg after it [m]


class AfterCorner(NamedTuple):
    """A leg after a corner, from the decision on it to the next one."""

    predicted: Prediction
    flown: Prediction

    @property
    def words(self) -> str:
        """Both, and the errors of the prediction."""
        errors = [100.0 * (told / real - 1.0) for told, real in zip(self.predicted, self.flown, strict=True)]
        return (
            f"flown {self.flown.time:5.1f} s {self.flown.energy:5.0f} J, predicted {self.predicted.time:5.1f} s "
            f"{self.predicted.energy:5.0f} J ({errors[0]:+.0f} %, {errors[1]:+.0f} %)"
        )


def fly(corner: float, length: float, airframe: str, pace: int, world: WorldSettings, *, stop: bool) -> AfterCorner:
    """Fly to a corner [deg], turn left, and fly a leg [m], to a stop or on."""
    vehicle = Simulation(load(airframe).parameters, start=Start(up=HEIGHT, airborne=True), tuning=Tuning(pace=pace))
    settings = Settings(leg_mode=LegMode.FORWARD, airspeed=15.0, min_leg=0.0)
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(settings, vehicle.tuning, world), airborne=True)
    aircraft.advance(SETTLED)
    c, s = math.cos(math.radians(corner)), math.sin(math.radians(corner))
    ends = [length] if stop else [length, length + RUN_OUT]
    autopilot = aircraft.autopilot
    autopilot.missions.load(
        [waypoint(RUN_UP, 0.0, HEIGHT), *(waypoint(RUN_UP + end * c, end * s, HEIGHT) for end in ends)]
    )
    autopilot.missions.start()
    made: list[tuple[Prediction, Prediction]] = []  # what was predicted, and the meters then
    while not has_finished_mission(aircraft):
        aircraft.advance(AUTOPILOT_PERIODS)
        made += [(one.forward, Prediction(vehicle.time, vehicle.energy)) for _, one in autopilot.decisions()]
    made.append((Prediction(0.0, 0.0), Prediction(vehicle.time, vehicle.energy)))
    (predicted, begun), (_, ended) = made[1:3]
    return AfterCorner(predicted, Prediction(ended.time - begun.time, ended.energy - begun.energy))


def main() -> None:
    """Print a line for each leg."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--airframe", default=AIRFRAME)
    parser.add_argument("--wind", type=float, default=0.0, help="[m/s]")
    parser.add_argument("--direction", type=float, default=0.0, help="where it comes from [deg]")
    options = parser.parse_args()
    world = WorldSettings(options.wind, options.direction, battery=1e9)
    for pace, length, stop, corner in itertools.product((GENTLE, BRISK), LENGTHS, (False, True), CORNERS):
        taken = fly(corner, length, options.airframe, pace, world, stop=stop)
        end = "to a stop" if stop else "flown on"
        print(f"DRK_PACE {pace}, {corner:3d} deg, {length:3.0f} m {end}: {taken.words}", flush=True)


if __name__ == "__main__":
    main()
