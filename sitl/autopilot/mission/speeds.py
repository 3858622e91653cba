"""The speeds that a mission asks for by DO_CHANGE_SPEED, in the place of those of the settings.

https://mavlink.io/en/messages/common.html#MAV_CMD_DO_CHANGE_SPEED
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from protocol.dialect import mavlink
from protocol.names import DEFAULT_SPEED, NO_CHANGE
from protocol.ranges import MAX_AIRSPEED, MIN_AIRSPEED
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point
from sitl.guidance.leg_speeds import airspeed_over_ground
from sitl.guidance.view import MAX_HOVER_CLIMB, MAX_HOVER_DESCENT

GROUND_SPEED = mavlink.SPEED_TYPE_GROUNDSPEED
CLIMB, DESCENT = mavlink.SPEED_TYPE_CLIMB_SPEED, mavlink.SPEED_TYPE_DESCENT_SPEED
MAX_VERTICAL_SPEEDS: dict[float, float] = {CLIMB: MAX_HOVER_CLIMB, DESCENT: MAX_HOVER_DESCENT}  # by SPEED_TYPE [m/s]
VERTICAL_WORDS: dict[float, str] = {CLIMB: "climbs", DESCENT: "descends"}
SPEED_TYPES = frozenset({mavlink.SPEED_TYPE_AIRSPEED, GROUND_SPEED, CLIMB, DESCENT})


@dataclass(slots=True)
class MissionSpeeds:
    """Speeds asked for [m/s]; None: the settings decide, or of climb and descent the laws."""

    hover: float | None = None
    cruise: float | None = None
    climb: float | None = None
    descent: float | None = None
    over_ground: bool = False  # the cruise is one over the ground

    def change(self, kind: float, speed: float, settings: Settings, *, can_fly_forward: bool) -> str:
        """Ask for a speed.

        Args:
            kind: SPEED_TYPE. Up to its limit that of the hover is one over the ground, whichever is named.
            speed: [m/s]; -1 changes nothing, -2 takes the defaults of this type.
            settings: With the limit of the hover.
            can_fly_forward: Whether there is a cruise.

        Returns:
            What the pilot is to know, or nothing.
        """
        wanted = None if speed == DEFAULT_SPEED else speed
        if speed == NO_CHANGE:
            return ""
        if kind == CLIMB:
            self.climb = wanted
        elif kind == DESCENT:
            self.descent = wanted
        elif wanted is None:
            self.hover = self.cruise = None
        elif wanted >= MIN_AIRSPEED and can_fly_forward:
            self.cruise, self.over_ground = wanted, kind == GROUND_SPEED
        else:
            self.hover = wanted
            if wanted > settings.hover_speed:
                return f"Speed {wanted:g} m/s: hover is limited to {settings.hover_speed:g} m/s"
        return ""

    def airspeed(self, settings: Settings) -> float:
        """Airspeed of legs in forward flight [m/s]."""
        return settings.airspeed if self.cruise is None else self.cruise

    def through_air(self, legs: Sequence[Point], speed: float, wind: Point) -> float:
        """The airspeed of the first of some legs at the speed of the cruise [m/s].

        Args:
            legs: Where the first leg begins, then the end of each, world NWU [m].
            speed: Of the cruise [m/s].
            wind: As it is estimated [m/s].
        """
        if self.cruise is None or not self.over_ground or len(legs) < 2:
            return speed
        return min(max(airspeed_over_ground(legs[0], legs[1], speed, wind), MIN_AIRSPEED), MAX_AIRSPEED)
