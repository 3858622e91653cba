"""Compiles everything a flight needs before it begins; a first start shares the work between two processes."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from typing import Self

from sitl.compiled import compiling
from sitl.defaults import AIRFRAME
from sitl.model.airframe_files import load
from sitl.prediction.chooser import LegEnd
from sitl.prediction.corners import Leg
from sitl.prediction.predictor import Abilities, predict_forward, predict_hover
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation import loop
from sitl.simulation.arrays import FlightArrays
from sitl.simulation.avionics import Navigation, equipped
from sitl.simulation.dispatch import REGISTER
from sitl.simulation.tuning import HYBRID, REPORTED, Tuning
from sitl.tools.kernel_cache import can_keep, is_complete, mark_complete
from sitl.vehicle.aircraft import Aircraft

LEG_LENGTH = 200.0  # length of a leg that can be hovered and flown forward [m]
FIRST_WORD = 5.0  # after which it is compiling: what an earlier start has kept is loaded sooner [s]
SIGN_OF_LIFE = 15.0  # between two lines while it compiles [s]
COMPILING = "compiling the flight model, the laws and the prediction (one to four minutes; kept for the next start)"
SENSES_DONE, PREDICTION_DONE = b"s", b"p"  # what a helper writes when it has compiled them
PROGRAM = "import os; from sitl.process.warm_up import compile_share; compile_share(lambda text: os.write(1, text))"


@contextmanager
def first_start() -> Iterator[Helper | None]:
    """Begin to compile beside the making of the vehicle, if nothing is kept of an earlier start.

    Yields:
        The process that compiles, for :func:`make_ready`; None where there is no use for one.
    """
    if is_complete() or not can_keep():
        yield None
    else:
        with Helper() as helper, compiling():  # the vehicle's design is compiled as well
            yield helper


def make_ready(aircraft: Aircraft, say: Callable[[str], None], helper: Helper | None = None) -> None:
    """Compile everything that flies and decides, or load what an earlier start has compiled. Nothing moves.

    Args:
        aircraft: The vehicle.
        say: Takes a text for the user if it takes long, as something is to be compiled.
        helper: Who compiles a share of it.
    """
    with nullcontext() if is_complete() else telling_time(say):
        if helper is not None:
            aircraft.vehicle.warm_up_parts(loop.MAIN_SHARE)
            helper.wait_for(SENSES_DONE)
        aircraft.warm_up()
        if helper is not None:
            helper.wait_for(PREDICTION_DONE)
        _plan_leg(aircraft)
    mark_complete()


@contextmanager
def telling_time(say: Callable[[str], None], every: float = SIGN_OF_LIFE, first: float = FIRST_WORD) -> Iterator[None]:
    """Say that it is compiling, and now and then for how long it has.

    Args:
        say: Takes a text for the user.
        every: Between two signs of life [s].
        first: Before anything is said [s].
    """
    done = threading.Event()

    def tell() -> None:
        if done.wait(first):
            return
        say(COMPILING)
        seconds = first
        while not done.wait(every):
            seconds += every
            say(f"still compiling, {seconds:.0f} s so far")

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        done.set()
        teller.join()


class Helper:
    """A process that compiles its share into the cache; it ends with the block at the latest.

    If it fails, whoever needs its share compiles it.

    Args:
        program: What it runs.
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
        """Wait until it has written something, at most as long as the work has taken so far.

        Args:
            what: ``SENSES_DONE`` or ``PREDICTION_DONE``.
        """
        if self._process is None or self._process.stdout is None:
            return
        pipe, written, end = self._process.stdout, b"", 2.0 * time.monotonic() - self._began
        while what not in written and select.select([pipe], [], [], max(end - time.monotonic(), 0.0))[0]:
            more = pipe.read(1)
            if not more:  # it has ended
                return
            written += more

    def __exit__(self, *error: object) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()


def compile_share(write: Callable[[bytes], object]) -> None:
    """The helper's share: what senses, and the prediction of a leg; for every airframe.

    Args:
        write: Takes ``SENSES_DONE`` and ``PREDICTION_DONE`` when all up to these is compiled.
    """
    airframe = load(AIRFRAME).parameters
    avionics = equipped(Navigation.SENSORS, load_sensors(), airframe, seed=1)
    with compiling():
        # Whoever waits makes its vehicle meanwhile, of whose design the compiled functions are here then to be read.
        FlightArrays(REGISTER, airframe, 1, avionics).warm_up(loop.SENSES)
        write(SENSES_DONE)
        for controller in (HYBRID, REPORTED):  # one may be changed for the other in flight
            flown = Tuning(controller=controller)
            abilities = Abilities(airframe, flown, can_fly_forward=True, hover_speed=3.0, airspeed=15.0)
            predict_hover(Leg(LEG_LENGTH, 0.0), abilities)
            predict_forward(Leg(LEG_LENGTH, 0.0), abilities)
    write(PREDICTION_DONE)


def _plan_leg(aircraft: Aircraft) -> None:
    """Run the leg planner once: the first real leg must not keep the vehicle from answering."""
    autopilot = aircraft.autopilot
    if autopilot.chooser is None:
        return
    north, west, up = autopilot.view.p
    start, stop = (north, west, up + LEG_LENGTH), LegEnd((north + LEG_LENGTH, west, up + LEG_LENGTH))
    autopilot.chooser.choose(autopilot.view, start, [stop], autopilot.settings, autopilot.settings.airspeed)
    autopilot.chooser.made()
