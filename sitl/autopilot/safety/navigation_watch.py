"""What navigation still has to go by in flight: the aids of the position, and the other instruments."""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.dialect import mavlink
from sitl.autopilot.safety.alarm import Alarm, SafetyAction
from sitl.guidance.view import VehicleView

CRITICAL, WARNING, INFO = mavlink.MAV_SEVERITY_CRITICAL, mavlink.MAV_SEVERITY_WARNING, mavlink.MAV_SEVERITY_INFO


@dataclass(slots=True)
class NavigationWatch:
    """A lost position asks for a landing, by inertial readings and height; other losses are said.

    Readings that are all refused are none: either way nothing tells the vehicle where it is.
    """

    lost: bool = False
    unfused: tuple[str, ...] = ()
    _resets: int | None = None
    _began: float | None = None  # [s]

    def check(self, view: VehicleView, timeout: float) -> list[Alarm]:
        """Alarms that begin now, and what is right again.

        Args:
            view: The vehicle.
            timeout: The position is lost after so long without an aid [s].
        """
        self._began = view.time if self._began is None else self._began
        return [*self._position(view, timeout), *self._others(view), *self._jumped(view)]

    def _position(self, view: VehicleView, timeout: float) -> list[Alarm]:
        age = min(view.position_age, view.time - (self._began or 0.0)) if math.isinf(view.position_age) else None
        was, self.lost = self.lost, (view.position_age if age is None else age) > timeout
        if self.lost and not was:
            return [Alarm(SafetyAction.LAND, CRITICAL, f"No position for {timeout:g} s", stop=True)]
        return [Alarm(None, INFO, "Position is back")] if was and not self.lost else []

    def _others(self, view: VehicleView) -> list[Alarm]:
        before, self.unfused = self.unfused, view.unfused
        return [
            *(Alarm(None, WARNING, f"Flying without {name}") for name in view.unfused if name not in before),
            *(Alarm(None, INFO, f"{name.capitalize()} is back") for name in before if name not in view.unfused),
        ]

    def _jumped(self, view: VehicleView) -> list[Alarm]:
        before, self._resets = self._resets, view.resets
        if before is None or view.resets == before:
            return []
        return [Alarm(None, WARNING, "Position estimate was wrong: taken from the readings")]
