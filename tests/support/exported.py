"""The controller exported and compiled once for all tests of a process."""

import tempfile
from functools import cache
from pathlib import Path
from shutil import which

import numpy as np
import pytest

from sitl.export.build import FlatController, shared_library
from sitl.export.controller import export
from sitl.export.estimator import navigation_of
from sitl.export.flat import FLAGS
from sitl.export.navigated_again import FlatEstimator
from sitl.model.airframe_files import load
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.dispatch import REGISTER
from sitl.simulation.tuning import Tuning, designed

AIRFRAME = load("darko").parameters
DESIGN = designed(AIRFRAME, Tuning())


@cache
def files(single=False):
    """The exported files by name, and what they were made with."""
    return export(REGISTER, DESIGN, single=single, title="test")


@cache
def folder(single=False):
    """A folder with them."""
    made = Path(tempfile.mkdtemp(prefix="darko-export-"))
    write(made, files(single).files)
    return made


def write(place, texts):
    """Write files by name."""
    for name, text in texts.items():
        path = place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


@cache
def code(cc="gcc", level="-O1", single=False):
    """The exported code as a compiler makes it."""
    need(cc)
    return FlatController(shared_library(folder(single), cc=cc, options=(level,)))


def need(program):
    """Skip a test that runs a program which is not there."""
    if which(program) is None:
        pytest.skip(f"{program} is not installed")


C_SOURCES = Path(__file__).parent / "c"


def program(place, flight, single=False):
    """Sources of a program that flies a recorded flight once more, and its data, in a folder; gives what to compile."""
    write(place, files(single).files)
    numbers = [[len(flight.rows) - 1, len(flight.design), len(flight.begin)], flight.design, flight.begin]
    data = np.concatenate([np.ravel(part) for part in (*numbers, flight.rows, flight.controllers)])
    (place / "replay.bin").write_bytes(data.astype("<f8").tobytes())
    for source in C_SOURCES.glob("*.c"):
        text = source.read_text(encoding="utf-8").replace("@flags@", str(FLAGS))
        (place / source.name).write_text(text, encoding="utf-8")
    return ["replay_main.c", "darko_controller.c"]


@cache
def estimator_files(arena=False, single=False):
    """Files of an export with the estimator, of the shipped instruments."""
    navigation = navigation_of(load_sensors(), DESIGN.gains.wind, arena=arena)
    return export(REGISTER, DESIGN, single=single, title="test", navigation=navigation).files


@cache
def estimator_folder(arena=False, single=False):
    """A folder with them."""
    made = Path(tempfile.mkdtemp(prefix="darko-estimator-"))
    write(made, estimator_files(arena, single))
    return made


@cache
def estimator(cc="gcc", level="-O1", arena=False, single=False):
    """The exported estimator as a compiler makes it."""
    need(cc)
    return FlatEstimator(shared_library(estimator_folder(arena, single), cc=cc, options=(level,)))


def estimator_program(place, flight, single=False):
    """Sources of a program that navigates a recorded flight once more, and its data; gives what to compile."""
    write(place, estimator_files(False, single))
    head = [len(flight.rows), flight.period, float(flight.has_tube)]
    parts = (head, flight.filter, flight.instruments, flight.steps, flight.rows, flight.estimates, flight.end)
    (place / "navigation.bin").write_bytes(np.concatenate([np.ravel(part) for part in parts]).astype("<f8").tobytes())
    for source in C_SOURCES.glob("*.c"):
        (place / source.name).write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
    return ["navigate_main.c", "darko_estimator.c"]
