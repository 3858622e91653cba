"""What a flight needs is compiled before it, not in it."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Self

from sitl._kernel_cache import can_keep, is_complete, mark_complete
from sitl.airframe import load
from sitl.compiled import compiling
from sitl.craft import Craft
from sitl.prediction.chooser import LegEnd
from sitl.prediction.predictor import Abilities, Leg, predict_forward, predict_hover
from sitl.simulation import loop
from sitl.simulation.simulation import Simulation
from sitl.simulation.tuning import Tuning

FAR = 200.0  # a leg both ways of flying can do [m]
JUMPS, PREDICTION = b"j", b"p"  # what a helper says when it has compiled it
PROGRAM = "import os; from sitl.rehearsal import help_out; help_out(lambda text: os.write(1, text))"


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
        _rehearse(craft)
    else:
        with Helper() as helper:
            craft.vehicle.warm_up_parts(loop.MOTION)
            helper.wait_for(JUMPS)
            craft.vehicle.warm_up()
            helper.wait_for(PREDICTION)
            _rehearse(craft)
    mark_complete()


class Helper:
    """A process that compiles its share, and keeps it where it is looked for; it ends with the block at the latest.

    Whatever becomes of it: what it has not done is compiled by whoever needs it.
    """

    def __init__(self, program: str = PROGRAM) -> None:
        self._program = program
        self._process: subprocess.Popen[bytes] | None = None
        self._began = time.monotonic()

    def __enter__(self) -> Self:
        paths = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}  # the same copy of the package
        with suppress(OSError):
            self._process = subprocess.Popen(  # noqa: S603 - this interpreter, and a program of this module
                [sys.executable, "-P", "-c", self._program],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | paths,
                bufsize=0,
            )
        return self

    def wait_for(self, what: bytes) -> None:
        """Wait until it says that it has done something, as long at most as the work has taken so far."""
        if self._process is None or self._process.stdout is None:
            return
        said, end = b"", 2.0 * time.monotonic() - self._began
        while what not in said and select.select([self._process.stdout], [], [], max(end - time.monotonic(), 0.0))[0]:
            more = self._process.stdout.read(1)
            if not more:  # it has ended
                return
            said += more

    def __exit__(self, *error: object) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()


def help_out(say: Callable[[bytes], object]) -> None:
    """The helper's share: jumps of the vehicle's loop, and the prediction of a leg both ways; serves every airframe."""
    airframe = load("nominal").parameters
    Simulation(airframe).warm_up_parts(loop.JUMPS)
    say(JUMPS)
    abilities = Abilities(airframe, Tuning(), can_fly_forward=True, hover_speed=3.0, airspeed=15.0)
    with compiling():
        predict_hover(Leg(FAR, 0.0), abilities)
        predict_forward(Leg(FAR, 0.0), abilities)
    say(PREDICTION)


def _rehearse(craft: Craft) -> None:
    """Run the leg planner once: the first real leg must not keep the vehicle from answering."""
    autopilot = craft.autopilot
    if autopilot.chooser is None:
        return
    north, west, up = autopilot.view.p
    start, stop = (north, west, up + FAR), LegEnd((north + FAR, west, up + FAR))
    autopilot.chooser.choose(autopilot.view, start, [stop], autopilot.settings, autopilot.settings.airspeed)
    autopilot.chooser.made()
