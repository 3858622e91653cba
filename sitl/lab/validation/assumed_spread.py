"""Claims of the aircraft's set that nobody measured, as intervals over what its file assumes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl import Actuators, Airframe, SitlError
from sitl.design.trim import trims
from sitl.lab.studies.campaign import perturbed
from sitl.model.propeller import drawn_power

# As the sources in darko.toml state them.
INTERVALS = {
    "C_d0": (0.064, 0.104),
    "C_90": (0.8, 1.2),
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
CLAIM_ENERGY = 1e5  # that ranges are told for [J]


class Claims(NamedTuple):
    """Claims of level flight in calm."""

    hover_power: float  # [W]
    cheapest_speed: float  # of which a metre costs least [m/s]
    distance: float  # at that speed with CLAIM_ENERGY [m]
    most_elevon: float  # at any speed [deg]


CLAIM_UNITS = ("W", "m/s", "m", "deg")


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
    )


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
