"""Missions near a fence: how many are broken off, and how many leave it.

``python scripts/bench/fences.py [--straight]`` flies 160 missions (seed 1): four shapes, eight airspeeds and winds,
five distances of the fence beyond the mission's northernmost point. ``--straight`` looks straight on to a stop,
whatever the plan is. Two to three minutes on one core.
"""
# The flights are those of the tests, which carry no types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import argparse
import itertools
import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from sitl.autopilot import fence_watch
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import Fence, Polygon
from sitl.model.airframe_files import load
from tests.support.flights.recorded_flight import HIGH, Flight
from tests.support.vehicle.mission_items import item, waypoint

RETURN = 3  # of GF_ACTION
CIRCLE = item(mavlink.MAV_CMD_NAV_LOITER_TURNS, 100, 0, HIGH, (2.0, 0.0, 40.0, math.nan))
MISSIONS = {  # northernmost point [m], items
    "corner": (140.0, (waypoint(140, 0, HIGH), waypoint(140, -140, HIGH))),
    "back": (140.0, (waypoint(140, 0, HIGH), waypoint(0, -30, HIGH))),
    "over": (130.0, (waypoint(100, 0, HIGH, radius=5.0), waypoint(0, -30, HIGH))),
    "circle": (140.0, (CIRCLE, waypoint(0, 0, HIGH))),
}
AIR = (  # airspeed [m/s], wind [m/s], from [deg]
    (15.0, 0.0, 0.0), (20.0, 0.0, 0.0), (15.0, 4.0, 180.0), (12.0, 6.0, 180.0), (15.0, 6.0, 90.0), (15.0, 6.0, 270.0),
    (10.0, 0.0, 0.0), (15.0, 5.0, 135.0),
)  # fmt: skip
ROOM = (6.0, 12.0, 16.0, 20.0, 30.0)  # between that point and the fence [m]
LIMIT, AFTERWARDS = 90.0, 12.0  # of a flight, and after its end [s]


def flown(name: str, air: tuple[float, float, float], room: float) -> tuple[bool, float]:
    """Whether a mission is broken off, and the distance flown beyond the fence [m]; negative inside."""
    north, items = MISSIONS[name]
    airspeed, wind, wind_from = air
    settings = Settings(leg_mode=LegMode.FORWARD, airspeed=airspeed, fence_action=RETURN)
    flight = Flight(
        settings=settings, plant=load("darko").parameters, wind_speed=wind, wind_from=wind_from,
        gusts=0.7 if wind else 0.0,
    )  # fmt: skip
    limit, wide = north + room, 200.0
    corners = np.array([(-60.0, -wide), (limit, -wide), (limit, wide), (-60.0, wide)])
    flight.autopilot.load_fence(Fence(inclusions=(Polygon(corners),)))
    flight.autopilot.missions.load(items)
    flight.autopilot.missions.start()
    until = LIMIT
    while flight.vehicle.time < until:
        flight.fly(0.5)
        mission = flight.autopilot.mission
        is_over = mission is None or mission.finished or any("Fence" in text for text in flight.texts)
        until = min(until, flight.vehicle.time + AFTERWARDS) if is_over else until
    return any("Fence" in text for text in flight.texts), float(flight.p[:, 0].max()) - limit


def main() -> None:
    """Fly them all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--straight", action="store_true", help="look straight on, as before")
    if parser.parse_args().straight:
        fence_watch.stays_inside = lambda *_: False
    results = [flown(*case) for case in itertools.product(MISSIONS, AIR, ROOM)]
    out = [beyond for _, beyond in results if beyond > 0.0]
    broken = sum(is_broken for is_broken, _ in results)
    print(f"{len(results)} missions: {broken} broken off, {len(out)} left the fence, by {max(out, default=0.0):.1f} m")


if __name__ == "__main__":
    main()
