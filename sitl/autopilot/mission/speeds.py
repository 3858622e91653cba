"""The speeds that a mission asks for by DO_CHANGE_SPEED, in the place of those of the settings.

https://mavlink.io/en/messages/common.html#MAV_CMD_DO_CHANGE_SPEED
"""

from __future__ import annotations

from dataclasses import dataclass

from protocol.dialect import mavlink
from protocol.names.command_values import DEFAULT_SPEED, NO_CHANGE
from sitl.autopilot.settings import Settings
from sitl.guidance.limits import MAX_HOVER_CLIMB, MAX_HOVER_DESCENT, MIN_AIRSPEED

CLIMB, DESCENT = mavlink.SPEED_TYPE_CLIMB_SPEED, mavlink.SPEED_TYPE_DESCENT_SPEED
MAX_VERTICAL_SPEEDS: dict[float, float] = {CLIMB: MAX_HOVER_CLIMB, DESCENT: MAX_HOVER_DESCENT}  # by SPEED_TYPE [m/s]
VERTICAL_WORDS: dict[float, str] = {CLIMB: "climbs", DESCENT: "descends"}
SPEED_TYPES = frozenset({mavlink.SPEED_TYPE_AIRSPEED, mavlink.SPEED_TYPE_GROUNDSPEED, CLIMB, DESCENT})


@dataclass(slots=True)
class MissionSpeeds:
    """Speeds asked for [m/s]; None: the settings decide, or of climb and descent the laws."""

    hover: float | None = None
    cruise: float | None = None
    climb: float | None = None
    descent: float | None = None

    def change(self, kind: float, speed: float, settings: Settings, *, can_fly_forward: bool) -> str:
        """Ask for a speed.

        Args:
            kind: SPEED_TYPE. Airspeed and ground speed are one: up to its limit that of the hover over the ground,
                from 7 m/s on that of the cruise through the air.
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
            self.cruise = wanted
        else:
            self.hover = wanted
            if wanted > settings.hover_speed:
                return f"Speed {wanted:g} m/s: hover is limited to {settings.hover_speed:g} m/s"
        return ""
