"""Flights of chance for comparisons: any law, attitude and motion, any request, wind and gusts; one number is one."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from protocol.dialect.vocabulary import Law
from sitl.control.reference import AttitudeReference, along, circle, hover_at, leg, steer
from sitl.export.flown_again import Ask, RecordedFlight, record
from sitl.model.airframe import Airframe
from sitl.model.quaternions import Quaternion, normalised
from sitl.model.state import Body
from sitl.model.vectors import Vector
from sitl.simulation.dispatch import REGISTER, Register
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start, whole_periods
from sitl.simulation.tuning import CONTROLLERS, Tuning

BEGINNING_HEIGHT = 60.0  # where flights begin that begin in the air [m]
ASKS = 3  # requests in a flight
LOW_SHARE = 0.15  # of flights that begin near the ground
TUNINGS = (
    Tuning(),
    Tuning(controller=CONTROLLERS["report"]),
    Tuning(controller=CONTROLLERS["report"], forward_linear=1, v_forward_enter=50.0, v_forward_leave=100.0),
    Tuning(controller=CONTROLLERS["indi"]),
    Tuning(controller=CONTROLLERS["robust-pi"]),
    Tuning(controller=CONTROLLERS["report"], design=0, integral=0, governor=2),
)


class Choice(NamedTuple):
    """A flight before it is flown."""

    name: str
    made: Simulation
    asks: tuple[tuple[int, Ask], ...]


def random_flight(
    number: int, seconds: float, airframes: tuple[Airframe, ...], seed: int = 1, register: Register = REGISTER
) -> RecordedFlight:
    """Fly one.

    Args:
        number: Which one.
        seconds: How long.
        airframes: Of which it is one.
        seed: Of all of them.
        register: Of its laws.
    """
    choice = chosen(number, seconds, airframes, seed, register)
    return record(choice.name, choice.made, whole_periods(seconds), choice.asks)


def chosen(number: int, seconds: float, airframes: tuple[Airframe, ...], seed: int, register: Register) -> Choice:
    """The flight of a number; arguments as for :func:`random_flight`."""
    rng = np.random.default_rng([seed, number])
    laws = list(register.laws)
    law = laws[int(rng.integers(len(laws)))]
    up = float(rng.uniform(0.5, 4.0)) if rng.random() < LOW_SHARE else BEGINNING_HEIGHT
    made = Simulation(
        airframes[int(rng.integers(len(airframes)))],
        seed=int(rng.integers(1, 1 << 30)),
        start=Start(up=up, heading=float(rng.uniform(-3.0, 3.0)), airborne=True),
        tuning=TUNINGS[int(rng.integers(len(TUNINGS)))],
        register=register,
    )
    speed = float(rng.choice([0.5, 3.0, 8.0]))
    still = float(rng.choice([0.2, 1.5]))
    made.place(
        Body(Vector(0.0, 0.0, up), _vector(rng, speed), _attitude(rng, made.truth.body.attitude), _vector(rng, still))
    )
    made.begin_flight(law)
    made.set_wind(_vector(rng, 3.0), float(rng.choice([0.0, 0.7])))
    times = sorted(int(t) for t in rng.integers(0, whole_periods(seconds), ASKS - 1))
    asks = tuple((time, _ask(rng, up)) for time in (0, *times))
    return Choice(f"flight {number} from {Law(law).name if law in set(Law) else law.name}", made, asks)


def _vector(rng: np.random.Generator, size: float) -> Vector:
    return Vector(*(float(x) for x in rng.normal(0.0, size, 3)))


def _attitude(rng: np.random.Generator, upright: Quaternion) -> Quaternion:
    """Anything, or near the upright."""
    off = rng.normal(0.0, float(rng.choice([0.05, 0.4, 2.0])), 4)
    return normalised(Quaternion(*(float(x + y) for x, y in zip(upright, off, strict=True))))


def _ask(rng: np.random.Generator, up: float) -> Ask:
    """Something to be asked for."""
    place = (float(rng.normal(0.0, 20.0)), float(rng.normal(0.0, 20.0)), up + float(rng.normal(0.0, 2.0)))
    far = (float(rng.normal(0.0, 80.0)), float(rng.normal(0.0, 80.0)), up + float(rng.normal(0.0, 5.0)))
    heading, airspeed = float(rng.uniform(-3.0, 3.0)), float(rng.uniform(8.0, 20.0))
    path = leg(place, far, airspeed, stop=bool(rng.random() < 0.7))
    ring = circle(place, float(rng.choice([-1.0, 1.0]) * rng.uniform(25.0, 80.0)), airspeed)
    tilt = AttitudeReference(_attitude(rng, Quaternion(0.7, 0.0, -0.7, 0.0)), _vector(rng, 0.2), float(rng.random()))
    wind = _vector(rng, 4.0)
    deeds: tuple[Callable[[Simulation], None], ...] = (
        lambda made: setattr(made, "reference", hover_at(place, heading)),
        lambda made: setattr(made, "reference", along(hover_at(place, heading), path, heading)),
        lambda made: setattr(made, "reference", along(hover_at(place, heading), ring, heading)),
        lambda made: setattr(made, "reference", steer(hover_at(place, heading), tilt)),
        lambda made: made.set_wind(wind),
        lambda made: setattr(made, "landing", not made.landing),
        lambda made: setattr(made, "armed", not made.armed),
    )
    return deeds[int(rng.choice(len(deeds), p=[0.25, 0.2, 0.15, 0.15, 0.1, 0.1, 0.05]))]
