"""Falls in still air from any attitude, side by side: what the campaigns of falls are compared with."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from sitl import Airframe, Array, Body, Law, Quaternion, Simulation, Start, Tuning, Vector, fly_batch, hover_at

FALL_HEIGHT = 600.0  # [m]
MAX_TUMBLE = 8.0  # [rad/s]
RETURN_SECONDS = 75.0  # after which everything is home
SAMPLE_RATE = 25.0  # a second
ALONE = Tuning(v_enter=0.0, v_leave=math.inf)  # nothing ends the law that begins


class Throw(NamedTuple):
    """Attitude and rates at the beginning of a fall."""

    attitude: Quaternion
    rates: Vector  # [rad/s]


def thrown(random: np.random.Generator, tumble: float | None = None) -> Throw:
    """A random attitude, and a tumble about a random axis; its rate is drawn too unless it is given [rad/s]."""
    attitude = random.normal(size=4)
    axis = random.normal(size=3)
    rate = random.uniform(0.0, MAX_TUMBLE) if tumble is None else tumble
    q, w = attitude / np.linalg.norm(attitude), rate * axis / np.linalg.norm(axis)
    return Throw(Quaternion(*(float(x) for x in q)), Vector(*(float(x) for x in w)))


def falling(
    airframe: Airframe,
    seed: int,
    velocity: Iterable[float],
    *,
    tumble: float | None = None,
    law: Law = Law.HOVER_ZERO_MOMENT,
    tuning: Tuning | None = None,
) -> Simulation:
    """A simulation at the beginning of a fall in still air, wanted where it is.

    Args:
        airframe: What falls.
        seed: Of the draw.
        velocity: World NWU [m/s].
        tumble: Its rate [rad/s]; drawn by default.
        law: In force in the beginning.
        tuning: Of the controller.
    """
    throw = thrown(np.random.default_rng(seed), tumble)
    made = Simulation(airframe, seed=seed, start=Start(up=FALL_HEIGHT, airborne=True), tuning=tuning)
    north, west, up = (float(x) for x in velocity)
    made.place(Body(Vector(0.0, 0.0, FALL_HEIGHT), Vector(north, west, up), throw.attitude, throw.rates))
    made.begin_flight(law)
    made.reference = hover_at((0.0, 0.0, FALL_HEIGHT), 0.0)
    return made


def fall(flights: Sequence[Simulation], seconds: float = RETURN_SECONDS) -> tuple[Array, Array]:
    """Fly falls for a time; gives height lost and distance from where they began, (n,) each [m]."""
    recordings = fly_batch(flights, seconds, rate=SAMPLE_RATE)
    lost = [FALL_HEIGHT - float(recording.position[:, 2].min()) for recording in recordings]
    away = [math.dist(flight.truth.body.position, (0.0, 0.0, FALL_HEIGHT)) for flight in flights]
    return np.array(lost), np.array(away)
