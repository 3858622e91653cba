"""The checks before arming."""

from __future__ import annotations

import math

from sitl.autopilot.settings import Settings
from sitl.guidance.view import VehicleView

MAX_STANDING_TILT = math.radians(15.0)  # the tail stands flat; more means it has tipped over
MAX_STANDING_SPEED = 0.2  # [m/s]


def refuse_arming(view: VehicleView, settings: Settings) -> list[str]:
    """Why a vehicle in this state may not be armed; empty if it may."""
    reasons = []
    if not view.landed:
        reasons.append("not on the ground")
    if view.tilt > MAX_STANDING_TILT:
        reasons.append(f"not upright ({math.degrees(view.tilt):.0f} deg from the vertical)")
    if math.hypot(*view.v) > MAX_STANDING_SPEED:
        reasons.append(f"moving at {math.hypot(*view.v):.1f} m/s")
    if view.battery_left < settings.battery_low:
        reasons.append(f"battery at {100 * view.battery_left:.0f} %")
    return reasons
