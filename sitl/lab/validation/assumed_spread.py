"""Claims of the aircraft's set that nobody measured, as intervals over what its file assumes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl import Actuators, Airframe, Settings, SitlError, Tuning
from sitl.design.gains import can_fly_forward
from sitl.design.trim import trims
from sitl.lab.studies.break_even import predicted
from sitl.lab.studies.wrong_models import perturbed
from sitl.model.battery import drawn_power
from sitl.prediction.predictor import Abilities

# As the sources in darko.toml state them.
INTERVALS = {
    "C_d0": (0.064, 0.104),
    "C_90": (0.8, 1.2),
    "per_stall": (1.0 / math.sin(math.radians(20.0)) ** 2, 1.0 / math.sin(math.radians(12.0)) ** 2),
    "k_h": (1e-5, 4e-5),
    "swirl": (0.258, 0.39),
    "motor_resistance": (0.06, 0.12),
    "idle_current": (0.7, 1.5),
    "controller_efficiency": (0.9, 0.97),
    "avionics_power": (2.0, 6.0),
    "battery_voltage": (11.4, 11.8),
    "battery_resistance": (0.015, 0.06),
}
CLAIM_SPEEDS = np.arange(0.0, 25.5, 1.0)  # [m/s]
CLAIM_ENERGY = 1e5  # that ranges are told for: nobody weighed its battery [J]
CLAIM_CRUISE = 15.0  # of legs that are flown forward [m/s]


class Claims(NamedTuple):
    """Claims of level flight in calm."""

    hover_power: float  # [W]
    cheapest_speed: float  # of which a metre costs least [m/s]
    distance: float  # at that speed with CLAIM_ENERGY [m]
    most_elevon: float  # at any speed [deg]
    break_even: float  # level leg from which on forward flight costs less, straight ahead; infinite: none to 300 m [m]
    break_even_turned: float  # the same after a turn by 90 deg [m]


CLAIM_UNITS = ("W", "m/s", "m", "deg", "m", "m")


def claims(a: Airframe) -> Claims:
    """Of one airframe, NaN where it has no trim."""
    level = trims(a, CLAIM_SPEEDS)
    drawn = [
        drawn_power(Actuators(t.omega, t.omega, 0.0, 0.0), t.speed * math.cos(t.theta), a) if t.exists else math.nan
        for t in level
    ]
    cost = np.array(drawn[1:]) / CLAIM_SPEEDS[1:]
    best = int(np.nanargmin(cost))
    return Claims(
        hover_power=drawn[0],
        cheapest_speed=float(CLAIM_SPEEDS[1 + best]),
        distance=CLAIM_ENERGY / float(cost[best]),
        most_elevon=max(math.degrees(abs(t.delta)) for t in level),
        break_even=_break_even(a, 0.0),
        break_even_turned=_break_even(a, 0.5 * math.pi),
    )


def _break_even(a: Airframe, turn: float) -> float:
    if not can_fly_forward(a):
        return math.inf
    able = Abilities(a, Tuning(), True, Settings().hover_speed, CLAIM_CRUISE)
    return predicted(able, 0.0, turn=turn).distance


def spread(a: Airframe, count: int, seed: int = 1) -> list[Claims]:
    """The claims of airframes drawn evenly from the intervals.

    Raises:
        SitlError: There is nothing to draw.
    """
    if count < 1:
        raise SitlError(f"--spread {count}: must be at least 1")
    random = np.random.default_rng(seed)
    return [claims(perturbed(a, _drawn(a, random))) for _ in range(count)]


def _drawn(a: Airframe, random: np.random.Generator) -> dict[str, float]:
    """Factors of what is assumed."""
    return {key: float(random.uniform(*bounds)) / float(getattr(a, key)) for key, bounds in INTERVALS.items()}


def as_text(own: Claims, drawn: list[Claims]) -> list[str]:
    """Each claim with the least and the greatest of the draws, as lines of text."""
    lines = [
        f"level flight in calm, {CLAIM_ENERGY / 1e3:g} kJ; in brackets over {len(drawn)} draws of what is assumed:"
    ]
    for name, value, unit, others in zip(Claims._fields, own, CLAIM_UNITS, zip(*drawn, strict=True), strict=True):
        lines.append(f"{name.replace('_', ' ')} {value:.4g} {unit} ({min(others):.4g} to {max(others):.4g})")
    return lines
