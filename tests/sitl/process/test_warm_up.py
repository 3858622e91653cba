"""A first start compiles in two processes; a helper that fails or hangs costs time and nothing else."""

import subprocess
import sys
import time
from pathlib import Path
from unittest.mock import create_autospec

import pytest

from sitl.autopilot.autopilot import Autopilot
from sitl.process import warm_up
from sitl.process.warm_up import COMPILING, PREDICTION_DONE, SENSES_DONE, Helper, first_start, make_ready, telling_time
from sitl.simulation import loop
from sitl.simulation.simulation import Simulation
from sitl.vehicle.aircraft import Aircraft

ROOT = Path(__file__).parent.parent.parent.parent
SAY = f"import os, time; os.write(1, {SENSES_DONE!r}); "
SHARE = """
import gc
from numba.extending import is_jitted
from protocol.dialect.vocabulary import LegMode
from sitl.autopilot.settings import Settings
from sitl.model.airframe_files import load
from sitl.prediction.forward_leg import fly_wing
from sitl.prediction.hover_leg import fly_hover
from sitl.prediction.indi_leg import fly_indi
from sitl.process.warm_up import compile_share
from sitl.simulation import loop
from sitl.simulation.simulation import Simulation
from tests.support.flights.recorded_flight import Flight
said = []
compile_share(said.append)
vehicle = Simulation(load("published").parameters)
vehicle.warm_up_parts(loop.MAIN_SHARE)
vehicle.warm_up()
for part in (loop.fly, *loop.PARTS):
    assert len(part.signatures) == 1, part  # the loop calls it with what it was compiled for
def used():
    return {one.py_func.__qualname__ for one in gc.get_objects() if is_jitted(one) and one.signatures}
flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD))
flight.aircraft.warm_up()
before = used()
flight.autopilot.guided.go_to((120.0, 0.0, 25.0))
flight.aircraft.advance(5000)
assert "INDI" in [jump.target.name for jump in flight.vehicle.jumps]
assert used() == before, used() - before
print(*(text.decode() for text in said), *(len(one.signatures) for one in (fly_hover, fly_wing, fly_indi)))
"""


@pytest.mark.long
def test_a_helper_compiles_what_the_vehicle_asks_for_and_a_flight_compiles_nothing_more():
    done = subprocess.run([sys.executable, "-c", SHARE], cwd=ROOT, capture_output=True, text=True, timeout=500)
    assert done.stdout.split() == ["s", "p", "1", "1", "1"], done.stderr


def test_while_it_compiles_the_vehicle_gives_signs_of_life():
    said = []
    with telling_time(said.append, 0.01, 0.01):
        for _ in range(1000):
            time.sleep(0.01)
            if len(said) > 1:
                break
    assert said[:2] == [COMPILING, "still compiling, 0 s so far"]


def test_what_is_loaded_soon_is_not_called_compiling():
    said = []
    with telling_time(said.append):
        time.sleep(0.05)
    assert said == []


def test_the_helper_is_waited_for_until_it_reports():
    with Helper("import time; time.sleep(0.3); " + SAY + "time.sleep(100)") as helper:
        time.sleep(1.0)
        began = time.monotonic()
        helper.wait_for(SENSES_DONE)
        assert time.monotonic() - began < 0.9
        process = helper._process
    assert process.poll() is not None  # nothing is left behind


@pytest.mark.parametrize("program", ["raise SystemExit(1)", "no Python", SAY])
def test_a_helper_that_ends_early_is_not_waited_for(program):
    with Helper(program) as helper:
        time.sleep(0.5)
        began = time.monotonic()
        helper.wait_for(PREDICTION_DONE)
        assert time.monotonic() - began < 0.4


def test_a_hanging_helper_is_waited_for_as_long_as_the_rest_took():
    with Helper("import time; time.sleep(100)") as helper:
        time.sleep(0.2)
        began = time.monotonic()
        helper.wait_for(SENSES_DONE)
        assert 0.1 < time.monotonic() - began < 2.0


def test_the_helper_ends_with_the_block():
    with pytest.raises(KeyboardInterrupt), Helper("import time; time.sleep(100)") as helper:
        raise KeyboardInterrupt
    assert helper._process.poll() is not None


def test_without_an_interpreter_to_run_there_is_no_helper(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    with Helper() as helper:
        helper.wait_for(SENSES_DONE)


@pytest.mark.parametrize(
    ("kept", "writable", "compiled", "waited"),
    [
        (False, True, [[part.__name__ for part in loop.MAIN_SHARE], "all"], [SENSES_DONE, PREDICTION_DONE]),
        (False, False, ["all"], []),  # nothing could be handed over
        (True, True, ["all"], []),
    ],
)
def test_a_helper_is_used_only_where_it_helps(monkeypatch, kept, writable, compiled, waited):
    fake, vehicle, done, texts = (
        create_autospec(Helper, instance=True),
        create_autospec(Simulation, instance=True),
        [],
        [],
    )
    fake.__enter__.return_value, fake.__exit__.return_value = fake, None
    vehicle.warm_up_parts.side_effect = lambda parts: done.append([part.__name__ for part in parts])
    monkeypatch.setattr(warm_up, "is_complete", lambda: kept)
    monkeypatch.setattr(warm_up, "can_keep", lambda: writable)
    monkeypatch.setattr(warm_up, "mark_complete", lambda: None)
    monkeypatch.setattr(warm_up, "Helper", lambda: fake)
    aircraft = create_autospec(Aircraft, instance=True)
    aircraft.vehicle, aircraft.autopilot = vehicle, create_autospec(Autopilot, instance=True, chooser=None)
    aircraft.warm_up.side_effect = lambda: done.append("all")
    with first_start() as helper:
        make_ready(aircraft, texts.append, helper)
    told = [call.args[0] for call in fake.wait_for.call_args_list]
    assert (done, told, texts) == (compiled, waited, [])  # nothing took long
