r"""Size of a vehicle beside the ones that the laws were tuned on, and what similarity makes of their constants.

Vehicles of one shape, of lengths in the ratio :math:`\lambda` and masses as :math:`\lambda^3`, move alike in the same
gravity and air if times go with :math:`\sqrt\lambda` (Froude). So a constant that was found on one of them is carried
over by its units. Mass and length are taken each by itself, as not all vehicles are of one shape.

Actuators may lag more than that: then it is their lag that the laws are slowed to.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.model.airframe import FIRST_ORDER, Airframe

# What counts as size 1, to the bit: the shipped sets, and models of them that are wrong by some 8 %.
SPANS = 0.54, 0.56  # [m]
MASSES = 0.45, 0.56  # [kg]
LOADINGS = 6.3, 7.9  # mass over span and chord [kg/m2]
# Lags beyond which the laws are slowed: those of the shipped sets, 0.05 and 0.043 s, and a fifth.
ELEVON_LAG, MOTOR_LAG = 0.06, 0.06  # [s]
ELEVON_TRAVEL_TIME = 0.12  # likewise, from its middle, of an elevon with a rate limit [s]


class Scale(NamedTuple):
    """Ratios to the vehicles that the laws were tuned on."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0  # of turning and hovering
    speed: float = 1.0  # through the air, of equal lift coefficients: what wind it is felt as


UNIT_SCALE = Scale()


def scale_of(a: Airframe) -> Scale:
    """Size of an airframe; exactly 1 in all for the shipped sets."""
    length = _beside(a.b, SPANS)
    return Scale(
        length=length,
        mass=_beside(a.m, MASSES),
        time=max(math.sqrt(length), _lag(a)),
        speed=math.sqrt(_beside(a.m / (a.b * a.c), LOADINGS)),
    )


def _lag(a: Airframe) -> float:
    """Lag of the slower of elevons and motors, over what the laws are not slowed for."""
    if a.actuator_model == FIRST_ORDER:
        return max(a.elevon_tau / ELEVON_LAG, a.motor_tau / MOTOR_LAG)
    return a.delta_max / a.delta_rate / ELEVON_TRAVEL_TIME


def _beside(value: float, known: tuple[float, float]) -> float:
    """Ratio to the nearer end of a range, 1 within it."""
    least, most = known
    return value / least if value < least else max(value / most, 1.0)
