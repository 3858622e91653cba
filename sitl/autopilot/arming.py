"""Pre-arm checks: each says in words what is wrong."""

from __future__ import annotations

import math

from sitl.autopilot.guidance import View
from sitl.autopilot.settings import Settings

UPRIGHT = math.radians(15.0)  # the tail stands flat; more means it has tipped over
AT_REST = 0.2  # [m/s]


def reasons(view: View, settings: Settings) -> list[str]:
    """Why the vehicle may not be armed; empty if it may."""
    found = []
    if not view.landed:
        found.append("not on the ground")
    if view.tilt > UPRIGHT:
        found.append(f"not upright ({math.degrees(view.tilt):.0f} deg from the vertical)")
    if math.hypot(*view.v) > AT_REST:
        found.append(f"moving at {math.hypot(*view.v):.1f} m/s")
    if view.energy_left < settings.battery_low:
        found.append(f"battery at {100 * view.energy_left:.0f} %")
    return found
