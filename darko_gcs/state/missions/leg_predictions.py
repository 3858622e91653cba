"""The vehicle's predictions for mission legs: DARKO_LEGS_REQUEST and DARKO_LEGS_PREDICTION as values."""

from __future__ import annotations

import math
from typing import NamedTuple

from protocol.dialect.vocabulary import LegMode
from protocol.frames import Vector


class LegChain(NamedTuple):
    """Legs in a row without a stop between them: the question."""

    points: tuple[Vector, ...]  # where the first begins and each ends, NED in the vehicle's local frame [m]
    asked: tuple[LegMode, ...]  # how each is to be flown
    heading: float | None = None  # before the first, clockwise from north [rad]; None: as it is
    hover_speed: float | None = None  # [m/s]; None: the vehicle's own
    airspeed: float | None = None  # of the cruise [m/s]; None: the vehicle's own


class LegPrediction(NamedTuple):
    """One leg of the answer. What is not possible takes an infinite time."""

    hover_time: float  # [s]
    hover_energy: float  # at the shafts [J]
    forward_time: float  # [s]
    forward_energy: float  # [J]
    leg_mode: int  # LegMode that the vehicle would fly
    reason: int  # DecisionReason

    @property
    def chosen(self) -> tuple[float, float]:
        """Time [s] and energy [J] the way it would be flown; NaN if the vehicle does not say which."""
        hover, forward = (self.hover_time, self.hover_energy), (self.forward_time, self.forward_energy)
        return {LegMode.HOVER: hover, LegMode.FORWARD: forward}.get(LegMode(self.leg_mode), (math.nan, math.nan))
