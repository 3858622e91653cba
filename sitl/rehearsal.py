"""What a flight needs is compiled before it, not in it."""

from __future__ import annotations

from collections.abc import Callable

from sitl._kernel_cache import is_complete, mark_complete
from sitl.craft import Craft
from sitl.prediction.chooser import LegEnd

FAR = 200.0  # a leg both ways of flying can do [m]


def make_ready(craft: Craft, say: Callable[[str], None]) -> None:
    """Have everything compiled that flies and decides; nothing moves.

    Args:
        craft: The vehicle.
        say: Told what is being compiled; nothing where that was kept from an earlier start.
    """
    is_kept = is_complete()
    if not is_kept:
        say("compiling the flight model, the laws and the prediction (kept for the next start)")
    craft.vehicle.warm_up()
    _rehearse(craft)
    mark_complete()


def _rehearse(craft: Craft) -> None:
    """Plan one leg, so that the prediction is compiled before the first real one."""
    autopilot = craft.autopilot
    if autopilot.chooser is None:
        return
    north, west, up = autopilot.view.p
    start, stop = (north, west, up + FAR), LegEnd((north + FAR, west, up + FAR))
    autopilot.chooser.choose(autopilot.view, start, [stop], autopilot.settings, autopilot.settings.airspeed)
    autopilot.chooser.made()
