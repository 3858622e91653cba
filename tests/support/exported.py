"""The controller exported and compiled once for all tests of a process."""

import tempfile
from functools import cache
from pathlib import Path
from shutil import which

import pytest

from sitl.export.build import FlatController, shared_library
from sitl.export.controller import export
from sitl.model.airframe_files import load
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
