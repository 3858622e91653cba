"""Watches of the vehicle itself: failures on board, navigation, and the links it depends on."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.dialect import mavlink
from sitl.autopilot.answers import Alarm, SafetyAction
from sitl.autopilot.settings import Settings
from sitl.guidance.view import VehicleView

# Detection of failures on board: an inertial instrument, an actuator, or control itself.

MIN_WATCH_HEIGHT = 1.0  # below it the ground may turn the vehicle [m]
SHAKING_RATIO = 1.4  # rms of the unexplained moment, in that of a failed actuator, that is failure at once [-]
MAX_TICK = 0.1  # a longer time since the last look was not looked at [s]
EMERGENCY = mavlink.MAV_SEVERITY_EMERGENCY


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
        aloft, share = view.p[2] > MIN_WATCH_HEIGHT, settings.unexplained_share
        odd, shaken = aloft and max(view.unexplained) > share, aloft and view.shaking > SHAKING_RATIO * share
        self.unexplained_for = max(self.unexplained_for + (passed if odd else -passed), 0.0)
        begins = (shaken or self.unexplained_for >= settings.unexplained_time) and not self.actuator_failed
        self.actuator_failed = begins or (self.actuator_failed and (shaken or self.unexplained_for > 0.0))
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


# A take-off that does not leave the ground: it is given up.


RISEN = 1.0  # above where it stood, a vehicle has left the ground [m]
RISEN_SHARE = 0.6  # of a lower take-off
RISE_TIME = 8.0  # given to a take-off beside what its climb rate needs for that [s]


@dataclass(slots=True)
class TakeOffWatch:
    """Watches a vehicle from when it stood until it has risen.

    Attributes:
        has_risen: It has, or began in the air.
    """

    has_risen: bool = True
    _stood: float = 0.0  # height of where it stood [m]
    _since: float | None = None  # when it began to rise [s]

    def check(self, view: VehicleView, height: float, climb_rate: float) -> str:
        """The reason why the take-off is given up; empty while it is not.

        Args:
            view: The vehicle.
            height: Where it is to be, world NWU [m].
            climb_rate: At which it climbs there [m/s].
        """
        if view.landed:
            self.has_risen, self._stood, self._since = False, view.p[2], None
            return ""
        if self.has_risen:
            return ""
        risen, wanted = view.p[2] - self._stood, min(RISEN, RISEN_SHARE * (height - self._stood))
        if wanted > 0.0 and risen >= wanted:
            self.has_risen = True
        if self.has_risen or wanted <= 0.0:
            return ""
        self._since = view.time if self._since is None else self._since
        passed = view.time - self._since
        if passed < RISE_TIME + RISEN / climb_rate:
            return ""
        failed = "".join(f", motor {number} has failed" for number in view.failed_motors)
        return f"{max(risen, 0.0):.1f} m up after {passed:.0f} s{failed}"


# Watch over navigation in flight: the aids of the position, and the other instruments.


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


# The links a flight depends on: any ground station, the one in control, and the companion computer.
#
# Each is watched by its HEARTBEATs on the link's time, and only after the first one: a link that never was cannot be
# lost. A link that is alive does not hide another that is lost.


LINK_ACTIONS = {  # by NAV_DLL_ACT and DRK_OBC_ACT
    0: SafetyAction.NONE,
    1: SafetyAction.HOLD,
    2: SafetyAction.RETURN,
    3: SafetyAction.LAND,
}


class LinkSilence(NamedTuple):
    """Time since the last HEARTBEAT of each link [s]; None: there never was one."""

    ground: float | None = None  # of any ground station
    in_control: float | None = None  # of the one in control, or of the one that fell silent in control
    companion: float | None = None  # of a companion computer


@dataclass(slots=True)
class _LinkWatch:
    lost: bool = False

    def changes(self, silence: float | None, timeout: float) -> bool | None:
        """True when the link is lost now, False when it is back now; None: neither."""
        was, self.lost = self.lost, _is_lost(silence, timeout)
        if self.lost == was or (was and silence is None):
            return None
        return self.lost


@dataclass(slots=True)
class LinkWatches:
    """Losses of the links; each loss is reported once."""

    _ground: _LinkWatch = field(default_factory=_LinkWatch)
    _in_control: _LinkWatch = field(default_factory=_LinkWatch)
    _companion: _LinkWatch = field(default_factory=_LinkWatch)

    @property
    def lost(self) -> bool:
        """Whether any of them is lost."""
        return self._ground.lost or self._in_control.lost or self._companion.lost

    def check(self, silence: LinkSilence, settings: Settings) -> list[Alarm]:
        """An alarm for each link that is lost now, and a message for each that is back.

        Args:
            silence: Of the links.
            settings: With the time-outs and the actions.
        """
        timeout, action = settings.link_timeout, LINK_ACTIONS[settings.link_action]
        ground = self._ground.changes(silence.ground, timeout)
        in_control = self._in_control.changes(silence.in_control, timeout)
        alarms = []
        if ground is not None:  # covers the one in control as well
            alarms.append(_alarm(ground, action, f"No ground station for {timeout:g} s", "Ground station is back"))
        elif in_control is not None:
            station = "Ground station in control"
            alarms.append(_alarm(in_control, action, f"{station} silent for {timeout:g} s", f"{station} is back"))
        timeout, action = settings.companion_timeout, LINK_ACTIONS[settings.companion_action]
        companion = self._companion.changes(silence.companion, timeout)
        if companion is not None:
            alarms.append(_alarm(companion, action, f"No companion for {timeout:g} s", "Companion is back"))
        return alarms


def missing_links(silence: LinkSilence, settings: Settings) -> list[str]:
    """Links that are lost now and whose loss would end a flight at once, in words."""
    links = (
        ("ground station", silence.ground, settings.link_timeout, settings.link_action),
        ("companion", silence.companion, settings.companion_timeout, settings.companion_action),
    )
    return [
        f"no {name} for {timeout:g} s" for name, since, timeout, action in links if action and _is_lost(since, timeout)
    ]


def _is_lost(silence: float | None, timeout: float) -> bool:
    return silence is not None and silence > timeout


def _alarm(lost: bool, action: SafetyAction, gone: str, back: str) -> Alarm:
    if lost:
        return Alarm(action, mavlink.MAV_SEVERITY_CRITICAL, gone)
    return Alarm(None, mavlink.MAV_SEVERITY_INFO, back)
