"""Flights that lose a link or run out of battery, flown to the ground.

``python scripts/bench/failsafes.py [--seeds N]`` prints figures of docs/failsafes.md: every kind of flight with each
action after a lost link (seed 1, still air), the energy of landings in a wind (seeds 10 to 9 + N, from two sides), and
flights away from home on a small battery (seeds 1 to N).
"""
# The flights are those of the tests, which carry no types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from protocol.names import Mode
from sitl.autopilot.answers import SafetyAction
from sitl.autopilot.failsafes import landing_energy
from tests.support.flights.failsafe_flights import (
    CRITICAL,
    ERRANDS,
    FORWARD,
    MODE_OF_ACTION,
    SITUATIONS,
    TIMEOUT,
    LinkFlight,
    Situation,
)
from tests.support.flights.recorded_flight import HIGH

LIMIT = 150.0  # [s]
NEAR = 8.0  # a landing begins here [m]


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=8, help="flights of each row [%(default)s]")
    seeds = parser.parse_args().seeds
    actions = (SafetyAction.HOLD, SafetyAction.RETURN, SafetyAction.LAND)
    table(("Lost while", *(action.name.lower() for action in actions)), links(actions))
    print()
    table(("Wind", "half", "three quarters", "longest"), landings(seeds))
    print()
    table(("Sent away by", "battery", "wind, gusts", "turned at", "left", "from home", "reported"), errands(seeds))


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Print a table in Markdown, row by row as they come."""
    head = tuple(head)
    for row in chain((head, ("---",) * len(head)), rows):
        print(f"| {' | '.join(row)} |", flush=True)


def links(actions: Iterable[SafetyAction]) -> Iterator[tuple[str, ...]]:
    """A row for each kind of flight: the outcome of each action."""
    for situation in SITUATIONS:
        yield situation.name, *(lost(situation, action) for action in actions)


def lost(situation: Situation, action: SafetyAction) -> str:
    """Fly one loss of the ground station until the vehicle stands still or has landed."""
    flight = situation.start(FORWARD._replace(link_action=int(action)))
    flight.lose("ground")
    flight.fly(TIMEOUT + 0.1)
    began = flight.vehicle.time
    if flight.autopilot.mode is Mode.HOLD:
        flight.fly_until(lambda: not flight.autopilot.view.forward and speed(flight) < 0.3, LIMIT)
        end = f"held at {flight.p[-1, 2]:.0f} m"
    else:
        mode = flight.autopilot.mode
        flight.land(LIMIT)
        end = f"{mode.name} to {off(flight):.0f} m"
    upset = ", upset" if flight.failsafes else ""
    wrong = "" if action <= situation.under_way or MODE_OF_ACTION[action] in flight.modes else ", not as requested"
    return f"{end}, {flight.vehicle.time - began:.0f} s{upset}{wrong}"


def landings(seeds: int) -> Iterator[tuple[str, ...]]:
    """A row for each wind: the energy of landings after forward flight, as a multiple of that in still air."""
    for wind, gusts in ((0.0, 0.7), (3.0, 0.7), (4.0, 0.7), (5.0, 0.7), (6.0, 1.0)):
        flown = [landing(wind, azimuth, gusts, 10 + seed) for azimuth in (180.0, 90.0) for seed in range(seeds)]
        yield f"{wind:g} m/s", *(f"{np.quantile(flown, share):.1f}" for share in (0.5, 0.75, 1.0))


def landing(wind: float, azimuth: float, gusts: float, seed: int) -> float:
    """The energy of one landing from 25 m, from 8 m horizontal distance on, as a multiple of that in still air."""
    settings = FORWARD._replace(battery_action=0)
    flight = LinkFlight(settings=settings, seed=seed, wind_speed=wind, wind_from=azimuth, gusts=gusts)
    calm = flight.aircraft.view()._replace(wind=(0.0, 0.0, 0.0))
    still = landing_energy(calm, (0.0, 0.0, HIGH), settings, flight.aircraft.vehicle.airframe)
    flight.autopilot.guided.go_to((200.0, 0.0, HIGH))
    flight.fly(7.0)
    flight.autopilot.guided.return_to_launch()
    turned = len(flight.time)
    flight.land(2.0 * LIMIT)
    near = turned + int(np.argmax(np.linalg.norm(flight.p[turned:, :2], axis=1) < NEAR))
    return float((flight.energy[-1] - flight.energy[near]) / still)


def errands(seeds: int) -> Iterator[tuple[str, ...]]:
    """A row for each errand: the worst and the median of its flights."""
    for errand in ERRANDS:
        flown = [errand.fly(seed) for seed in range(1, (seeds if errand.gusts else 1) + 1)]
        left = [flight.aircraft.battery.remaining for flight in flown]
        cannot = sum(any("out of reach" in text or "critical" in text for text in flight.texts) for flight in flown)
        short = sum(share < CRITICAL for share in left)
        yield (
            errand.name,
            f"{errand.capacity / 1e3:.0f} kJ",
            f"{errand.wind:g}, {errand.gusts:g} m/s",
            f"{np.median([flight.p[:, 0].max() for flight in flown]):.0f} m",
            f"{min(left):.0%} to {max(left):.0%}",
            f"{max(off(flight) for flight in flown):.1f} m",
            f"{cannot} of {len(flown)} ({short} below {CRITICAL:.0%})",
        )


def off(flight: LinkFlight) -> float:
    """Final distance from home [m]."""
    return float(np.linalg.norm(flight.p[-1, :2]))


def speed(flight: LinkFlight) -> float:
    """Present speed [m/s]."""
    return float(np.linalg.norm(flight.v[-1]))


if __name__ == "__main__":
    main()
