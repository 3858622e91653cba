"""Detection of failures on board: an inertial instrument, an actuator, or control itself."""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.dialect import mavlink
from sitl.autopilot.safety.alarm import Alarm, SafetyAction
from sitl.autopilot.settings import Settings
from sitl.guidance.view import VehicleView

MIN_WATCH_HEIGHT = 1.0  # below it the ground may turn the vehicle [m]
MAX_TICK = 0.1  # a longer time since the last look was not looked at [s]
CRITICAL, EMERGENCY = mavlink.MAV_SEVERITY_CRITICAL, mavlink.MAV_SEVERITY_EMERGENCY


@dataclass(slots=True)
class FailureDetector:
    """Watches a flight; each failure is reported once, and again only after it was gone."""

    tumbled_for: float = 0.0  # of late: what is caught counts off again [s]
    looked_at: float = math.inf  # [s]
    tumbled: bool = False
    blind: bool = False  # the gyroscope has failed
    numb: bool = False  # the accelerometer has failed
    unexplained_for: float = 0.0  # of late a moment was not explained so long: what is explained again counts off [s]
    actuator_failed: bool = False

    def check(self, view: VehicleView, settings: Settings) -> list[Alarm]:
        """Alarms that begin at this tick of a flight."""
        cut = SafetyAction.TERMINATE if settings.detector_action else SafetyAction.NONE
        alarms = []
        if view.gyroscope_failed and not self.blind:
            alarms.append(Alarm(cut, EMERGENCY, "Gyroscope failed"))
        if view.accelerometer_failed and not self.numb:
            alarms.append(Alarm(SafetyAction.LAND, CRITICAL, "Accelerometer failed"))
        self.blind, self.numb = view.gyroscope_failed, view.accelerometer_failed
        passed = min(max(view.time - self.looked_at, 0.0), MAX_TICK)
        self.looked_at = view.time
        return alarms + self._failed_actuator(view, settings, cut, passed) + self._tumble(view, settings, cut, passed)

    def _failed_actuator(self, view: VehicleView, settings: Settings, cut: SafetyAction, passed: float) -> list[Alarm]:
        """A motor or an elevon that does not do as it is commanded: no law flies without it."""
        odd = max(view.unexplained) > settings.unexplained_share and view.p[2] > MIN_WATCH_HEIGHT
        self.unexplained_for = max(self.unexplained_for + (passed if odd else -passed), 0.0)
        begins = self.unexplained_for >= settings.unexplained_time and not self.actuator_failed
        self.actuator_failed = begins or (self.actuator_failed and self.unexplained_for > 0.0)
        return [Alarm(cut, EMERGENCY, "A motor or an elevon failed")] if begins else []

    def _tumble(self, view: VehicleView, settings: Settings, cut: SafetyAction, passed: float) -> list[Alarm]:
        """Tumbling that no law has caught in its time."""
        rate = math.degrees(math.hypot(*view.rates))
        self.tumbled_for = max(self.tumbled_for + (passed if rate > settings.tumble_rate else -passed), 0.0)
        begins = self.tumbled_for >= settings.tumble_time and not self.tumbled
        self.tumbled = begins or (self.tumbled and self.tumbled_for > 0.0)
        return [Alarm(cut, EMERGENCY, f"Tumbling at {rate:.0f} deg/s")] if begins else []

    @property
    def is_critical(self) -> bool:
        """Whether something fails now."""
        return self.blind or self.numb or self.tumbled or self.actuator_failed
