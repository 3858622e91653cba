"""The arena in flight: hold before net and obstacles; at the net land, and at the last cut the motors."""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.dialect import mavlink
from sitl.autopilot.safety.alarm import Alarm, SafetyAction
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point
from sitl.enclosure.geometry import THE_NET, Arena
from sitl.guidance.view import VehicleView

HOLD, LAND, CUT = 2, 3, 4  # of DRK_NET_ACT
# A hovering vehicle that is told to hold stands after this time at its speed, and in a tail wind after longer.
HOVER_STANDS_AFTER, LATER_BY_WIND = 0.6, 0.25  # [s], [s per m/s]
RETREAT = 1.2  # since a law that does not know the wind stands downwind of where it should hold [m]
SPEEDING_UP_TIME = 0.6  # for which a transition to forward flight still gains speed after such an order [s]
PIECES = 4  # of the way to a stop, whose ends are looked at
RAISED_AGAIN = 1.0  # after so long, if something is neared still [s]
CALM_TIME = 2.0  # of room again after which an alarm is over [s]
WARNING, CRITICAL = mavlink.MAV_SEVERITY_WARNING, mavlink.MAV_SEVERITY_CRITICAL
EMERGENCY = mavlink.MAV_SEVERITY_EMERGENCY


def way_to_stop(view: VehicleView) -> list[Point]:
    """Points from where the vehicle is to where the law in force can stop it, world NWU [m]."""
    speed = math.hypot(view.v[0], view.v[1])
    tail_wind = (view.wind[0] * view.v[0] + view.wind[1] * view.v[1]) / max(speed, 0.1)
    seconds = HOVER_STANDS_AFTER + LATER_BY_WIND * max(tail_wind, 0.0)
    if view.forward and speed > 1.0:
        seconds = SPEEDING_UP_TIME + view.stopping_distance / speed
    times = [seconds * k / PIECES for k in range(PIECES + 1)]
    return [(view.p[0] + t * view.v[0], view.p[1] + t * view.v[1], view.p[2] + t * view.v[2]) for t in times]


@dataclass(slots=True)
class ArenaWatch:
    """Raises each stage of the chain once; it begins anew after a while with room enough."""

    near: bool = False  # too near, or about to be
    lands: bool = False
    is_cut: bool = False
    _since: float = 0.0  # when the vehicle itself came too near [s]
    _raised: float = -math.inf  # the first stage, last time [s]
    _last: float = -math.inf  # when there last was too little room [s]

    def check(self, view: VehicleView, arena: Arena, settings: Settings, *, landing: bool) -> list[Alarm]:
        """Alarms that begin now.

        Args:
            view: The vehicle as it is now.
            arena: With its net and obstacles.
            settings: With the action and its thresholds.
            landing: Whether it lands already: then only the last stage is left.
        """
        rooms = [arena.room(p) for p in way_to_stop(view)]
        (room, what), (ahead, before) = rooms[0], min(rooms)
        if ahead >= settings.net_room:
            if view.time - self._last > CALM_TIME:
                self.near = self.lands = False
            self._since = view.time
            return []
        self._last = view.time
        at_net = what == THE_NET  # before an obstacle it holds: it may stand under the vehicle
        if room >= settings.net_room or not at_net:
            self._since = view.time
        if (
            at_net
            and room < settings.net_cut
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
        if self.near and (view.time - self._raised < RAISED_AGAIN or not self._nears(view, arena, room)):
            return []
        self.near, self._raised = True, view.time
        action = SafetyAction.HOLD if settings.net_action >= HOLD else SafetyAction.NONE
        reason = f"{max(room, 0.0):.1f} m from {what}"
        if before != what:
            reason = f"Would stop {max(ahead, 0.0):.1f} m from {before}"
        return [Alarm(action, WARNING, reason, stop=True, always=True, retreat=RETREAT)]

    def _nears(self, view: VehicleView, arena: Arena, room: float) -> bool:
        """Whether the vehicle comes nearer still."""
        soon = (view.p[0] + 0.1 * view.v[0], view.p[1] + 0.1 * view.v[1], view.p[2] + 0.1 * view.v[2])
        return arena.room(soon)[0] < room
