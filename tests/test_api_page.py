"""The worked examples of docs/api.md run as they stand, and the public API is what it says."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import sitl

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^## (.+?)\n.*?```python\n(.*?)```", PAGE, re.DOTALL | re.MULTILINE)


@pytest.mark.long
@pytest.mark.parametrize(("title", "code"), EXAMPLES, ids=[title for title, _ in EXAMPLES])
def test_an_example_runs(title: str, code: str, tmp_path: Path) -> None:
    script = tmp_path / "example.py"
    script.write_text(code, encoding="utf-8")
    # Laws of one's own are compiled in every process: tests/sitl/simulation/test_dispatch.py does it, here is its text.
    plain = {"NUMBA_DISABLE_JIT": "1"} if title == "A law of your own" else {}
    command, environment = [sys.executable, script], os.environ | plain
    done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=ROOT, timeout=300)
    assert done.returncode == 0, done.stderr
    expected = {"One flight": "INDI", "Thousands of flights": "64 of 64 are home", "A law of your own": "climbed"}
    assert expected[title] in done.stdout


def test_there_are_three_examples() -> None:
    assert len(EXAMPLES) == 3


def test_every_public_name_can_be_loaded() -> None:
    assert all(getattr(sitl, name) is not None for name in sitl.__all__)
    assert set(sitl.__all__) == set(sitl._NAMES)


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="Vehicle"):
        sitl.Vehicle  # noqa: B018


@pytest.mark.long
def test_importing_the_package_loads_no_compiler_and_the_vehicle_no_scipy() -> None:
    """Its optimisation alone would be a third of what a vehicle loads."""
    code = (
        "import sitl, sys; print('numba' in sys.modules); "
        "import sitl.process.vehicle_process; print('scipy.optimize' in sys.modules)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert said.stdout.split() == ["False", "False"]
