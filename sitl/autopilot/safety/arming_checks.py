"""The checks before arming, and what is said of a vehicle that can fly no more."""

from __future__ import annotations

import math

from sitl.autopilot.settings import Settings
from sitl.control.reference import Point
from sitl.guidance.view import VehicleView

MAX_STANDING_TILT = math.radians(15.0)  # the tail stands flat; more means it has tipped over
MAX_STANDING_SPEED = 0.4  # satellites alone make it look like 0.25 [m/s]


def refuse_arming(view: VehicleView, settings: Settings) -> list[str]:
    """The reason why a vehicle in this state may not be armed; empty if it may."""
    if view.crash is not None:
        return [f"crashed {_into(view)}at {view.crash.speed:.1f} m/s: a reboot stands it up again"]
    if not view.aligned:  # nothing else is known yet
        return list(view.awaited)
    reasons = list(view.awaited)
    if not view.landed:
        reasons.append("not on the ground")
    if view.tilt > MAX_STANDING_TILT:
        reasons.append(f"not upright ({math.degrees(view.tilt):.0f} deg from the vertical)")
    if math.hypot(*view.v) > MAX_STANDING_SPEED:
        reasons.append(f"moving at {math.hypot(*view.v):.1f} m/s")
    if view.battery_remaining < settings.battery_low:
        reasons.append(f"battery at {100 * view.battery_remaining:.0f} %")
    return reasons


def crash_text(view: VehicleView, home: Point) -> str:
    """Text of a crash: its speed, the thing hit and the place; empty without a crash. ``home`` is in world NWU [m]."""
    if view.crash is None:
        return ""
    place = view.crash.place
    north, west = place.x - home[0], place.y - home[1]
    along, across = "north" if north >= 0.0 else "south", "west" if west >= 0.0 else "east"
    hit = f"Crashed {_into(view)}at {view.crash.speed:.1f} m/s"
    return f"{hit}, {abs(north):.0f} m {along} {abs(west):.0f} m {across} of home"


def _into(view: VehicleView) -> str:
    return f"into {view.touched} " if view.touched else ""
