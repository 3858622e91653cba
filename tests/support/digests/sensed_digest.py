"""A short flight by each kind of navigation, and a hash of every bit of it: also a process of its own."""

import hashlib
import json

from tests.support.flights.sensed_flights import MOCAP, SENSORS, hovering, on_ground, state_of_all

PERIODS = {"sensors": 110, "motion capture": 50}  # beyond the filter's horizon; of others:
FEW = 25


def sensed_flights():
    """Flights of the digest, by name."""
    restarted = hovering(MOCAP, 3)
    restarted.advance(20)
    restarted.avionics.restart()
    return {
        "sensors": hovering(SENSORS, 1),
        "motion capture": hovering(MOCAP, 2),
        "restarted": restarted,
        "on the ground": on_ground(SENSORS, 4, aligned=False),
    }


def sensed_digests():
    """Hash of every flight, by name."""
    found = {}
    for name, made in sensed_flights().items():
        made.advance(PERIODS.get(name, FEW))
        found[name] = hashlib.sha256(state_of_all(made)).hexdigest()
    return found


if __name__ == "__main__":
    print(json.dumps(sensed_digests()))
