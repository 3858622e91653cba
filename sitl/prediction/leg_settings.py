"""The settings that the choice between hover and forward flight depends on."""

from __future__ import annotations

from typing import Protocol


class LegSettings(Protocol):
    """The pilot's settings about legs; the autopilot's settings have them, among others."""

    @property
    def leg_mode(self) -> int:
        """0 the better one, 1 always hover, 2 forward flight wherever possible."""

    @property
    def min_leg(self) -> float:
        """Shorter legs are hovered [m]."""

    @property
    def leg_time(self) -> float:
        """Time limit per leg [s]; 0: none."""

    @property
    def hover_speed(self) -> float:
        """Horizontal speed limit of the hover [m/s]."""

    @property
    def airspeed(self) -> float:
        """Of the cruise [m/s]."""
