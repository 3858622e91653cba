"""The arena's net and obstacles in flight: hold before they are reached, land, and cut the motors at the last."""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.dialect import mavlink
from sitl.autopilot.safety.alarm import Alarm, SafetyAction
from sitl.autopilot.safety.fence import path_to_stop
from sitl.autopilot.settings import Settings
from sitl.enclosure.geometry import Arena
from sitl.guidance.view import VehicleView

HOLD, LAND, CUT = 2, 3, 4  # of DRK_NET_ACT
CALM_TIME = 2.0  # of room again after which an alarm is over [s]
WARNING, CRITICAL = mavlink.MAV_SEVERITY_WARNING, mavlink.MAV_SEVERITY_CRITICAL
EMERGENCY = mavlink.MAV_SEVERITY_EMERGENCY


@dataclass(slots=True)
class ArenaWatch:
    """Raises each stage of the chain once; it begins anew after a while with room enough."""

    near: bool = False  # too near, or about to be
    lands: bool = False
    is_cut: bool = False
    _since: float = 0.0  # when the vehicle itself came too near [s]
    _last: float = -math.inf  # when there last was too little room [s]

    def check(self, view: VehicleView, arena: Arena, settings: Settings, *, landing: bool) -> list[Alarm]:
        """Alarms that begin now.

        Args:
            view: The vehicle as it is now.
            arena: With its net and obstacles.
            settings: With the action and its thresholds.
            landing: Whether it lands already: then only the last stage is left.
        """
        room, what = arena.room(view.p)
        ahead, before = min(arena.room(p) for p in path_to_stop(view))
        if ahead >= settings.net_room:
            if view.time - self._last > CALM_TIME:
                self.near = self.lands = False
            self._since = view.time
            return []
        self._last = view.time
        if room >= settings.net_room:
            self._since = view.time
        if (
            room < settings.net_cut
            and settings.net_action >= CUT
            and not self.is_cut
            and self._nears(view, arena, room)
        ):
            self.is_cut = True
            return [Alarm(SafetyAction.TERMINATE, EMERGENCY, f"{room:.1f} m from {what}")]
        if landing:
            return []
        if settings.net_action >= LAND and not self.lands and view.time - self._since > settings.net_land_time:
            self.lands = True
            return [Alarm(SafetyAction.LAND, CRITICAL, f"Still {room:.1f} m from {what}")]
        if self.near:
            return []
        self.near = True
        action = SafetyAction.HOLD if settings.net_action >= HOLD else SafetyAction.NONE
        return [Alarm(action, WARNING, f"{max(room, 0.0):.1f} m from {before}", stop=True)]

    def _nears(self, view: VehicleView, arena: Arena, room: float) -> bool:
        """Whether the vehicle comes nearer still."""
        soon = (view.p[0] + 0.1 * view.v[0], view.p[1] + 0.1 * view.v[1], view.p[2] + 0.1 * view.v[2])
        return arena.room(soon)[0] < room
