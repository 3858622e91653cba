"""Flights of chance on sensors: hovers that move on, legs and starts, in wind, with instruments that fail."""

from __future__ import annotations

import numpy as np

from protocol.dialect.vocabulary import Law
from sitl.control.reference import along, hover_at, leg
from sitl.export.flown_again import Ask
from sitl.export.navigated_again import RecordedNavigation, record_navigation
from sitl.model.airframe import Airframe
from sitl.sensors.instruments import DRIFTING, EXTERNAL_POSE, HEALTHY, INSTRUMENTS, OFF, SensorSet
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start, whole_periods

BEGIN_UP = 40.0  # where flights begin that begin in the air [m]
GROUND_SHARE, FAILING_SHARE = 0.2, 0.7
_INSTRUMENTS = [number for number in range(INSTRUMENTS) if number != EXTERNAL_POSE]


def random_navigation(
    number: int,
    seconds: float,
    airframe: Airframe,
    sensors: SensorSet,
    navigation: Navigation,
    seed: int = 1,
) -> RecordedNavigation:
    """Fly one.

    Args:
        number: Which one.
        seconds: How long.
        airframe: As it is, and as the vehicle knows it.
        sensors: Its instruments.
        navigation: Whether satellites or motion capture aid it.
        seed: Of all of them.
    """
    rng = np.random.default_rng([seed, number, 7])
    stands = rng.random() < GROUND_SHARE
    up = 0.0 if stands else BEGIN_UP
    made = Simulation(
        airframe,
        seed=int(rng.integers(1, 1 << 30)),
        start=Start(up=up, heading=float(rng.uniform(-3.0, 3.0)), airborne=not stands),
        navigation=navigation,
        sensors=sensors,
        aligned=not stands,
    )
    made.set_wind(rng.normal(0.0, (2.5, 2.5, 0.2)), float(rng.choice([0.0, 0.4, 1.0])))
    if not stands:
        made.begin_flight(Law.HOVER_ZERO_MOMENT)
    begin, then = rng.uniform((0.0, 0.3), (0.3, 0.8)) * whole_periods(seconds)
    asks = [(int(begin), _go(rng, up))]
    if rng.random() < FAILING_SHARE:
        asks.append((int(then), _fail(rng)))
    words = f"navigation {number} {'from the ground' if stands else 'in the air'}"
    return record_navigation(words, made, whole_periods(seconds), asks)


def _go(rng: np.random.Generator, up: float) -> Ask:
    """Take off or fly to a place, over a leg or in the hover."""
    place = (float(rng.normal(0.0, 40.0)), float(rng.normal(0.0, 40.0)), up + float(rng.uniform(2.0, 8.0)))
    heading, airspeed = float(rng.uniform(-3.0, 3.0)), float(rng.uniform(10.0, 18.0))
    hover = hover_at(place, heading)
    on_wing = up > 0.0 and rng.random() < 0.5
    path = leg((0.0, 0.0, up), place, airspeed, stop=bool(rng.random() < 0.5))

    def go(made: Simulation) -> None:
        made.armed = made.flying = True
        made.reference = along(hover_at((0.0, 0.0, up), heading), path, heading) if on_wing else hover

    return go


def _fail(rng: np.random.Generator) -> Ask:
    """Let an instrument fail in any way."""
    instrument, way = int(rng.choice(_INSTRUMENTS)), int(rng.integers(HEALTHY + 1, DRIFTING + 1))
    way = OFF if rng.random() < 0.2 else way

    def fail(made: Simulation) -> None:
        made.avionics.instruments.failures[instrument] = way
        made.avionics.instruments.failed_at[instrument] = made.periods

    return fail
