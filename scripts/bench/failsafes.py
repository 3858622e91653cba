"""What becomes of flights that lose a link or run out of battery, flown to the ground.

``python scripts/bench/failsafes.py [--seeds N]`` prints the tables of docs/failsafes.md: every way of flying with every
action after a lost link (seed 1, still air), and flights away from home on a small battery (seeds 1 to N).
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
from protocol.modes import Mode
from sitl.autopilot.alarm import Action
from tests.support.failsafe_flights import CRITICAL, ERRANDS, MODES, ON_THE_WING, TIMEOUT, WAYS, Begun, LinkFlight

LIMIT = 150.0  # [s]


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    seeds = parser.parse_args().seeds
    actions = (Action.HOLD, Action.RETURN, Action.LAND)
    table(("Lost while", *(action.name.lower() for action in actions)), links(actions))
    print()
    table(("Sent away by", "battery", "wind, gusts", "turned at", "left", "from home", "said so"), errands(seeds))


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Print a table in Markdown, row by row as they come."""
    head = tuple(head)
    for row in chain((head, ("---",) * len(head)), rows):
        print(f"| {' | '.join(row)} |", flush=True)


def links(actions: Iterable[Action]) -> Iterator[tuple[str, ...]]:
    """A row for each way of flying: what each action came to."""
    for begun in WAYS:
        yield begun.name, *(lost(begun, action) for action in actions)


def lost(begun: Begun, action: Action) -> str:
    """Fly one loss of the ground station until the vehicle stands still, or on the ground."""
    flight = begun.start(ON_THE_WING._replace(link_action=int(action)))
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
    wrong = "" if action <= begun.under_way or MODES[action] in flight.modes else ", not as asked"
    return f"{end}, {flight.vehicle.time - began:.0f} s{upset}{wrong}"


def errands(seeds: int) -> Iterator[tuple[str, ...]]:
    """A row for each errand: the worst and the middle of its flights."""
    for errand in ERRANDS:
        flown = [errand.fly(seed) for seed in range(1, (seeds if errand.gusts else 1) + 1)]
        left = [flight.craft.battery.left for flight in flown]
        cannot = sum(any("out of reach" in text or "critical" in text for text in flight.said) for flight in flown)
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
    """How far from home it is [m]."""
    return float(np.linalg.norm(flight.p[-1, :2]))


def speed(flight: LinkFlight) -> float:
    """How fast it is [m/s]."""
    return float(np.linalg.norm(flight.v[-1]))


if __name__ == "__main__":
    main()
