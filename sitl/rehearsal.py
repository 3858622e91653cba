"""What a flight needs is compiled before it, not in it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from sitl._kernel_cache import can_keep, is_complete, mark_complete
from sitl.airframe import load
from sitl.craft import Craft
from sitl.prediction.chooser import LegEnd
from sitl.prediction.predictor import Abilities, Leg, predict_forward, predict_hover
from sitl.simulation.tuning import Tuning

FAR = 200.0  # a leg both ways of flying can do [m]
HELPER = "from sitl.rehearsal import compile_prediction; compile_prediction()"  # a Python program


def make_ready(craft: Craft, say: Callable[[str], None]) -> None:
    """Have everything compiled that flies and decides; nothing moves.

    Args:
        craft: The vehicle.
        say: Told what is being compiled; nothing where that was kept from an earlier start.
    """
    is_kept = is_complete()
    if not is_kept:
        say("compiling the flight model, the laws and the prediction (kept for the next start)")
    if is_kept or not can_keep():
        craft.vehicle.warm_up()
    else:
        with helped():
            craft.vehicle.warm_up()
    _rehearse(craft)
    mark_complete()


@contextmanager
def helped() -> Iterator[None]:
    """A process of its own compiles the prediction meanwhile, and keeps it where it is looked for afterwards.

    It is waited for as long again as the rest took. Whatever becomes of it, what it did not do is compiled here.
    """
    helper, began = _helper(), time.monotonic()
    try:
        yield
        if helper is not None:
            with suppress(subprocess.TimeoutExpired):
                helper.wait(time.monotonic() - began)
    finally:
        if helper is not None:
            helper.kill()
            helper.wait()


def _helper() -> subprocess.Popen[bytes] | None:
    """A process that runs the helper's program, on the same copy of the package; None where there can be none."""
    nowhere = subprocess.DEVNULL
    paths = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        return subprocess.Popen(  # noqa: S603 - this interpreter, and a program of this module
            [sys.executable, "-P", "-c", HELPER], stdin=nowhere, stdout=nowhere, stderr=nowhere, env=os.environ | paths
        )
    except OSError:
        return None


def compile_prediction() -> None:
    """Predict a leg flown both ways: what that compiles serves every airframe and tuning."""
    abilities = Abilities(load("nominal").parameters, Tuning(), can_fly_forward=True, hover_speed=3.0, airspeed=15.0)
    predict_hover(Leg(FAR, 0.0), abilities)
    predict_forward(Leg(FAR, 0.0), abilities)


def _rehearse(craft: Craft) -> None:
    """Run the leg planner once: the first real leg must not keep the vehicle from answering."""
    autopilot = craft.autopilot
    if autopilot.chooser is None:
        return
    north, west, up = autopilot.view.p
    start, stop = (north, west, up + FAR), LegEnd((north + FAR, west, up + FAR))
    autopilot.chooser.choose(autopilot.view, start, [stop], autopilot.settings, autopilot.settings.airspeed)
    autopilot.chooser.made()
