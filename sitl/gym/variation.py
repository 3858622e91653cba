"""Variation of airframe and weather from episode to episode: an interval for each name.

A specification of another tool is as good as one written by hand: it is a mapping from names to (low, high).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sitl import Airframe, SitlError, Vector
from sitl.gym.flight_tasks import TaskWeather

WIND_NAME, GUSTS_NAME = "wind", "gusts"
Intervals = Mapping[str, tuple[float, float]]
LARGEST = {WIND_NAME: 30.0, GUSTS_NAME: 10.0}  # [m/s]
MAX_FACTOR = 10.0


class EpisodeConditions(NamedTuple):
    """Conditions of one episode."""

    airframe: Airframe  # as it is; controllers and filters believe in the nominal one
    wind: Vector  # world NWU [m/s]
    gusts: float  # rms per axis [m/s]


class Variation:
    """Intervals that are drawn from anew in every episode, uniformly.

    Args:
        airframe: The nominal one.
        weather: Of the task.
        intervals: By name: a constant of the airframe, as a factor of its nominal value; ``wind``, the speed of a
            level wind from anywhere [m/s]; ``gusts``, their rms per axis [m/s].

    Raises:
        SitlError: If a name is none of these, or an interval is none.
    """

    def __init__(self, airframe: Airframe, weather: TaskWeather, intervals: Intervals | None = None) -> None:
        self._airframe = airframe
        chosen = {name: _checked(name, interval) for name, interval in (intervals or {}).items()}
        self.wind, self.gusts = chosen.pop(WIND_NAME, weather.wind), chosen.pop(GUSTS_NAME, weather.gusts)
        self.factors = chosen

    @property
    def has_gusts(self) -> bool:
        """Whether an episode may have gusts."""
        return self.gusts[1] > 0.0

    def draw(self, random: np.random.Generator) -> EpisodeConditions:
        """Conditions of the next episode."""
        airframe = self._airframe
        if self.factors:
            drawn = {name: random.uniform(*interval) for name, interval in self.factors.items()}
            airframe = airframe._replace(**{name: getattr(airframe, name) * by for name, by in drawn.items()})
        wind, gusts = Vector(0.0, 0.0, 0.0), 0.0
        if self.wind[1] > 0.0:
            speed, azimuth = random.uniform(*self.wind), random.uniform(-math.pi, math.pi)
            wind = Vector(speed * math.cos(azimuth), speed * math.sin(azimuth), 0.0)
        if self.has_gusts:
            gusts = random.uniform(*self.gusts)
        return EpisodeConditions(airframe, wind, gusts)


def _checked(name: str, interval: tuple[float, float]) -> tuple[float, float]:
    floats = [field for field, kind in Airframe.__annotations__.items() if kind in {float, "float"}]
    if name not in LARGEST and name not in floats:
        raise SitlError(f"variation of {name!r}: there is {', '.join((*LARGEST, *floats))}")
    try:
        low, high = (float(end) for end in interval)
    except (TypeError, ValueError):
        raise SitlError(f"variation of {name}: {interval!r} is no interval (low, high)") from None
    most, least = LARGEST.get(name, MAX_FACTOR), 0.0 if name in LARGEST else 1.0 / MAX_FACTOR
    if not least <= low <= high <= most:
        raise SitlError(f"variation of {name}: {low:g} to {high:g} is no interval within {least:g} and {most:g}")
    return low, high
