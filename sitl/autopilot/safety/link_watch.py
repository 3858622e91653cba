"""The links a flight depends on: any ground station, the one in control, and the companion computer.

Each is watched by its HEARTBEATs on the link's time, and only after the first one: a link that never was cannot be
lost. A link that is alive does not hide another that is lost.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.dialect import mavlink
from sitl.autopilot.safety.alarm import Alarm, SafetyAction
from sitl.autopilot.settings import Settings

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
