"""The links a flight depends on: any ground station, the one in control, and the companion computer.

Each is watched by its HEARTBEATs on the link's time, and only after a first one: what was never there cannot be lost.
One link that is alive hides no other that is lost.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.dialect import mavlink
from sitl.autopilot.alarm import LINK_ACTIONS, Action, Alarm
from sitl.autopilot.settings import Settings

__all__ = ["LinkWatches", "Silence", "missing"]

BACK = mavlink.MAV_SEVERITY_INFO


class Silence(NamedTuple):
    """Time since the last HEARTBEAT of each [s]; None: there never was one."""

    ground: float | None = None  # of any ground station
    in_control: float | None = None  # of the one in control; of the one that fell silent in control
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
    """What is lost now, so that each loss is told of once."""

    _ground: _LinkWatch = field(default_factory=_LinkWatch)
    _in_control: _LinkWatch = field(default_factory=_LinkWatch)
    _companion: _LinkWatch = field(default_factory=_LinkWatch)

    @property
    def lost(self) -> bool:
        """Whether any of them is lost."""
        return self._ground.lost or self._in_control.lost or self._companion.lost

    def check(self, silence: Silence, settings: Settings) -> list[Alarm]:
        """An alarm for each link that is lost now, and a word for each that is back.

        Args:
            silence: Of the links.
            settings: With the time-outs and the actions.
        """
        after, action = settings.link_timeout, LINK_ACTIONS[settings.link_action]
        ground = self._ground.changes(silence.ground, after)
        in_control = self._in_control.changes(silence.in_control, after)
        alarms = []
        if ground is not None:  # which says all there is to say of the one in control
            alarms.append(_told(ground, action, f"No ground station for {after:g} s", "Ground station is back"))
        elif in_control is not None:
            who = "The ground station in control"
            alarms.append(_told(in_control, action, f"{who} is silent for {after:g} s", f"{who} is back"))
        after, action = settings.companion_timeout, LINK_ACTIONS[settings.companion_action]
        companion = self._companion.changes(silence.companion, after)
        if companion is not None:
            alarms.append(_told(companion, action, f"No companion for {after:g} s", "Companion is back"))
        return alarms


def missing(silence: Silence, settings: Settings) -> list[str]:
    """Links that are lost and whose loss would end the flight it begins with, in words."""
    links = (
        ("ground station", silence.ground, settings.link_timeout, settings.link_action),
        ("companion", silence.companion, settings.companion_timeout, settings.companion_action),
    )
    return [f"no {name} for {after:g} s" for name, since, after, action in links if action and _is_lost(since, after)]


def _is_lost(silence: float | None, timeout: float) -> bool:
    return silence is not None and silence > timeout


def _told(lost: bool, action: Action, gone: str, back: str) -> Alarm:
    return Alarm(action, mavlink.MAV_SEVERITY_CRITICAL, gone) if lost else Alarm(None, BACK, back)
