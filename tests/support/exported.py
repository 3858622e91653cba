"""The controller exported and compiled once for all tests of a process."""

import tempfile
from functools import cache
from pathlib import Path
from shutil import which

import pytest

from sitl.export.build import FlatController, shared_library
from sitl.export.builds import FLY, NAVIGATE, write_flight, write_navigation
from sitl.export.controller import export
from sitl.export.estimator import navigation_of
from sitl.export.navigated_again import FlatEstimator
from sitl.export.templates import template
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


def program(place, flight, what=FLY, single=False):
    """Sources of a program that flies or navigates a recorded flight once more, and its data, in a folder."""
    navigates = what == NAVIGATE
    write(place, estimator_files(False, single) if navigates else files(single).files)
    (write_navigation if navigates else write_flight)(place, flight)
    write(place, {f"{what}.c": template(f"replay/{what}.c")})
    return [f"{what}.c", "darko_estimator.c" if navigates else "darko_controller.c"]


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
