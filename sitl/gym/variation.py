"""Variation of airframe and weather from episode to episode: an interval for each name, or a campaign's draws."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np

from sitl import Airframe, Configuration, SitlError, Vector
from sitl.gym.flight_tasks import TaskWeather
from sitl.lab.campaigns.number_expressions import TIME_NAME, NumberWalker, has_name
from sitl.lab.campaigns.specification import draw, load_specification

WIND_NAME, GUSTS_NAME = "wind", "gusts"
Intervals = Mapping[str, tuple[float, float]]
LARGEST = {WIND_NAME: 30.0, GUSTS_NAME: 10.0}  # [m/s]
MAX_FACTOR = 10.0
GUSTS_PARAMETER = "SIM_GUST_RMS"
WEATHER_PARAMETERS = ("SIM_WIND_SPD", "SIM_WIND_DIR", GUSTS_PARAMETER)  # of a campaign's file
CAMPAIGN_CASES = 10**6  # that an episode takes one of


class EpisodeConditions(NamedTuple):
    """Conditions of one episode."""

    airframe: Airframe  # as it is; controllers and filters believe in the nominal one
    wind: Vector  # world NWU [m/s]
    gusts: float  # rms per axis [m/s]


class Variation(Protocol):
    """Conditions that are drawn anew in every episode."""

    @property
    def has_gusts(self) -> bool:
        """Whether an episode may have gusts."""

    @property
    def changes_airframe(self) -> bool:
        """Whether episodes have airframes of their own."""

    def draw(self, random: np.random.Generator) -> EpisodeConditions:
        """Conditions of the next episode."""


def variation_of(airframe: Airframe, weather: TaskWeather, vary: Intervals | str | None) -> Variation:
    """The variation that is asked for: by intervals, or a campaign's specification by its name or file.

    Raises:
        SitlError: It is not usable.
    """
    if isinstance(vary, str):
        return CampaignVariation(airframe, vary)
    return IntervalVariation(airframe, weather, vary)


class CampaignVariation:
    """Airframe, wind and gusts as the cases of a campaign have them; an episode takes one of a million at random.

    Args:
        airframe: The nominal one.
        name: Of a shipped campaign, or a file.

    Raises:
        SitlError: It cannot be read, or its weather changes within a flight.
    """

    def __init__(self, airframe: Airframe, name: str) -> None:
        self._airframe, self._specification = airframe, load_specification(name)
        given = self._specification.flight.parameters
        self._weather = {key: str(given[key]) for key in WEATHER_PARAMETERS if key in given}
        for key, text in self._weather.items():
            if has_name(text, TIME_NAME):
                raise SitlError(f"variation by {name}: {key} = {text!r} changes within a flight")

    @property
    def has_gusts(self) -> bool:
        """Whether a case may have gusts."""
        return GUSTS_PARAMETER in self._weather

    @property
    def changes_airframe(self) -> bool:
        """Whether cases have airframes of their own."""
        return self._specification.airframe_draw is not None

    def draw(self, random: np.random.Generator) -> EpisodeConditions:
        """Conditions of a case.

        Raises:
            SitlError: Its weather is out of the bounds of the parameters.
        """
        case = draw(self._specification, int(random.integers(CAMPAIGN_CASES)))
        walker = NumberWalker(case.values | {"seed": float(case.seed)})
        air = Configuration().replaced({key: walker.number(text) for key, text in self._weather.items()}).world
        return EpisodeConditions(case.airframe(self._airframe), air.wind, air.gusts)


class IntervalVariation:
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

    @property
    def changes_airframe(self) -> bool:
        """Whether episodes have airframes of their own."""
        return bool(self.factors)

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
