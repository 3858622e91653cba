"""One leg decided on the ground: what decisions need is compiled before the flight, not in it."""

from __future__ import annotations

from sitl.autopilot.choice import Stop
from sitl.craft import Craft

FAR = 200.0  # a leg both ways of flying can do [m]


def rehearse(craft: Craft) -> None:
    """Decide how to fly a leg, and forget it: the first real one must not keep the vehicle from answering."""
    autopilot = craft.autopilot
    if autopilot.chooser is None:
        return
    north, west, up = autopilot.view.p
    start, stop = (north, west, up + FAR), Stop((north + FAR, west, up + FAR))
    autopilot.chooser.choose(autopilot.view, start, [stop], autopilot.settings, autopilot.settings.airspeed)
    autopilot.chooser.made()
