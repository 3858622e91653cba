"""Recovery of the hover after streamed attitudes: the figures of docs/laws.md.

``python scripts/attitude_limits.py [--flights N] [--seed N]`` streams random attitudes and thrusts within the limits to
vehicles that hover at 25 m, for 8 s or until a limit ends it, and prints a row for each case of wind and airframe.
"""

from __future__ import annotations

import argparse
import math
from typing import NamedTuple

import numpy as np

from protocol.dialect.vocabulary import Law
from protocol.frames import LocalFrame
from protocol.names import Mode
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.control.reference import AttitudeReference
from sitl.defaults import HOME
from sitl.guidance.setpoints import MAX_TILT, MIN_THRUST
from sitl.model.airframe import Airframe
from sitl.model.airframe_files import load
from sitl.model.quaternions import Quaternion, hover, multiply
from sitl.model.vectors import Vector
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS, Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings

HEIGHT = 25.0  # [m]
MAX_TIME = 8.0  # of the streamed attitude [s]
HOLD_TIME = 12.0  # after it [s]
UNCERTAIN = ["m", "J1", "J2", "J3", "C_l", "C_d0", "xi_f", "xi_m", "Delta_r", "k_f", "k_m", "C_lp", "C_mq", "C_nr"]
CASES = (
    ("calm", 0.0, 0.0, 0.0),
    ("3 m/s, gusts 1.0", 3.0, 1.0, 0.0),
    ("5 m/s, gusts 1.5", 5.0, 1.5, 0.0),
    ("gusts 0.5, coefficients +-20 %", 0.0, 0.5, 0.2),
)


class Result(NamedTuple):
    """One flight."""

    height_lost: float  # after the set-points ended [m]
    falls: int  # entries into the failsafe law
    upset: bool  # whether the attitude was lost


def fly(rng: np.random.Generator, seed: int, wind: float, gusts: float, share: float) -> Result:
    """One random attitude at one random thrust, and the hold after it."""
    nominal = load("nominal").parameters
    start = Start(up=HEIGHT, airborne=True)
    vehicle = Simulation(_varied(nominal, rng, share), seed=seed, start=start, design_model=nominal)
    air = WorldSettings(wind, rng.uniform(0.0, 360.0), gusts, battery=1e6)
    world = World(LocalFrame(HOME), ARENAS["open"])
    aircraft = Aircraft(vehicle, world, Configuration(Settings(), Tuning(), air), airborne=True)
    aircraft.advance(1000)
    attitude, autopilot, end = _draw(rng), aircraft.autopilot, vehicle.time + MAX_TIME
    autopilot.offboard.set_attitude(attitude)
    autopilot.set_mode(Mode.OFFBOARD)
    while autopilot.mode is Mode.OFFBOARD and vehicle.time < end:
        autopilot.offboard.set_attitude(attitude)
        aircraft.advance(AUTOPILOT_PERIODS)
    autopilot.guided.hold()
    high = lowest = vehicle.truth.body.position.z
    for _ in range(round(HOLD_TIME / 0.02)):
        aircraft.advance(AUTOPILOT_PERIODS)
        lowest = min(lowest, vehicle.truth.body.position.z)
    names = [jump.name for jump in vehicle.jumps]
    return Result(high - lowest, sum(jump.target is Law.FAILSAFE for jump in vehicle.jumps), "upset" in names)


def _draw(rng: np.random.Generator) -> AttitudeReference:
    side = rng.uniform(-math.pi, math.pi)
    half = 0.5 * rng.uniform(0.0, MAX_TILT)
    tilt = Quaternion(math.cos(half), 0.0, math.sin(half) * math.cos(side), math.sin(half) * math.sin(side))
    q = multiply(hover(rng.uniform(-math.pi, math.pi)), tilt)
    return AttitudeReference(q, Vector(0.0, 0.0, 0.0), rng.uniform(MIN_THRUST, 1.0))


def _varied(a: Airframe, rng: np.random.Generator, share: float) -> Airframe:
    return a._replace(**{name: getattr(a, name) * rng.uniform(1.0 - share, 1.0 + share) for name in UNCERTAIN})


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=100, help="flights of each case [%(default)s]")
    parser.add_argument("--seed", type=int, default=11, help="seed of the draws [%(default)s]")
    arguments = parser.parse_args()
    for name, *case in CASES:
        rng = np.random.default_rng(arguments.seed)
        flown = [fly(rng, seed, *case) for seed in range(arguments.flights)]
        lost = np.percentile([result.height_lost for result in flown], (90, 100))
        falls, upset = sum(result.falls for result in flown), sum(result.upset for result in flown)
        figures = f"height lost {lost[0]:.1f} / {lost[1]:.1f} m, {falls} falls, {upset} upset"
        print(f"{name:<32} {len(flown)} flights, {figures}")


if __name__ == "__main__":
    main()
