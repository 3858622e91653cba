"""Watch over navigation in flight: the aids of the position, and the other instruments."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from protocol.dialect import mavlink
from sitl.autopilot.safety.alarm import Alarm, SafetyAction
from sitl.guidance.view import VehicleView

LASTING = 30.0  # two corrections of the estimate within such a time contradict each other [s]
FIRST_HELP_TIME = 1.0  # with instruments that have not helped yet, at the beginning of a flight [s]
BACK_TIME = 5.0  # an instrument is back that has helped for so long [s]
CRITICAL, WARNING, INFO = mavlink.MAV_SEVERITY_CRITICAL, mavlink.MAV_SEVERITY_WARNING, mavlink.MAV_SEVERITY_INFO


@dataclass(slots=True)
class NavigationWatch:
    """A lost position asks for a landing, by inertial readings and height; other losses are said.

    Attributes:
        lost: Nothing tells the position, or nothing that could be believed.
    """

    lost: bool = False
    _began: float | None = None  # [s]
    _without: dict[str, float] = field(default_factory=dict)  # instruments, and when each was last of no help [s]
    _resets: int | None = None
    _corrected: float = -math.inf  # when the estimate last was, by readings that it had refused [s]
    _doubted: float = -math.inf  # when that was for the second time [s]

    def check(self, view: VehicleView, timeout: float) -> list[Alarm]:
        """Alarms that begin now, and what is right again.

        Args:
            view: The vehicle.
            timeout: The position is lost after so long without an aid [s].
        """
        if self._began is None:
            self._began, self._resets = view.time, view.resets
        return [*self._corrections(view), *self._position(view, timeout), *self._instruments(view)]

    def _corrections(self, view: VehicleView) -> list[Alarm]:
        if view.resets == self._resets:
            return []
        self._resets, before, self._corrected = view.resets, self._corrected, view.time
        if view.time - before < LASTING:
            self._doubted = view.time
            return []
        return [Alarm(None, WARNING, "Position estimate was wrong: reset to the sensors")]

    def _position(self, view: VehicleView, timeout: float) -> list[Alarm]:
        flown = view.time - (self._began or 0.0)
        age = flown if math.isinf(view.position_age) else view.position_age
        is_doubtful = view.time - self._doubted < LASTING
        was, self.lost = self.lost, is_doubtful or age > timeout
        if self.lost and not was:
            reason = "Position readings contradict each other" if is_doubtful else f"No position for {timeout:g} s"
            return [Alarm(SafetyAction.LAND, CRITICAL, reason)]
        return [Alarm(None, INFO, "Position is back")] if was and not self.lost else []

    def _instruments(self, view: VehicleView) -> list[Alarm]:
        if view.time - (self._began or 0.0) < FIRST_HELP_TIME:
            return []
        lost = [name for name in view.unfused if name not in self._without]
        self._without |= dict.fromkeys(view.unfused, view.time)
        back = [name for name, last in self._without.items() if view.time - last >= BACK_TIME]
        for name in back:
            del self._without[name]
        return [
            *(Alarm(None, WARNING, f"Flying without {name}") for name in lost),
            *(Alarm(None, INFO, f"{name.capitalize()} is back") for name in back),
        ]
