"""The wheel holds every module and data file of the three packages, the generated dialect too, and both programs."""

from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parent.parent
PACKAGES = ("protocol", "sitl", "darko_gcs")
BUILDER = WheelBuilder(str(ROOT))


@pytest.fixture(scope="module")
def packed():
    """The files of a wheel that is built from this tree."""
    return {file.distribution_path for file in BUILDER.recurse_included_files()}


def test_the_wheel_has_every_file_of_the_packages_and_nothing_else(packed):
    files = (path for package in PACKAGES for path in (ROOT / package).rglob("*") if path.is_file())
    assert packed == {path.relative_to(ROOT).as_posix() for path in files if path.parent.name != "__pycache__"}


def test_the_wheel_has_the_generated_dialect_and_the_data(packed):
    assert {"protocol/dialect/mavlink.py", "protocol/dialect/vocabulary.py", "protocol/dialect/darko.xml"} <= packed
    assert {"sitl/model/airframes/collage.toml", "sitl/sensors/data/gnss.toml", "darko_gcs/tui/app.tcss"} <= packed


@pytest.mark.parametrize("program", ["darko-gcs", "darko-sitl"])
def test_the_wheel_installs_the_program(program):
    installed = EntryPoint(program, BUILDER.metadata.core.scripts[program], "console_scripts")
    assert callable(installed.load())


def test_the_top_of_the_tree_holds_no_wheel():
    """A download that is left there would be committed with the next change."""
    assert not list(ROOT.glob("*.whl"))
