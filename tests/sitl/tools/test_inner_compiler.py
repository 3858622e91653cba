"""Inner functions are linked into their callers; parts are linked into the whole as they are compiled."""

import subprocess
import sys
from pathlib import Path

import pytest
from numba import types

from sitl.compiled import UNCOUNTED, bare, kernel, part, subroutine, whole
from sitl.tools import inner_compiler

ROOT = Path(__file__).parent.parent.parent.parent
ANOTHER = """
import sys
from sitl.compiled import whole
from tests.sitl.tools.test_inner_compiler import first
print(whole(lambda x, power: first(x, power))(1.5, 3), *first.stats.cache_hits.values())
print("scipy.linalg" in sys.modules)
"""


@kernel
def doubled(x):
    return 2.0 * x


@subroutine
def raised(x, power):
    product = 1.0
    for _ in range(power):
        product *= doubled(x)
    return product


@part
def first(x, power):
    return raised(x, power) + doubled(x)


@whole
def both(x, power):
    return first(x, power) - doubled(x)


@pytest.fixture
def finished(monkeypatch):
    """Names of the functions of which no machine code was made."""
    seen = []
    finish = inner_compiler._Inner._finalize_final_module
    monkeypatch.setattr(
        inner_compiler._Inner, "_finalize_final_module", lambda self: (seen.append(self.name), finish(self))
    )
    return seen


def test_inner_functions_live_in_their_callers_alone(finished):
    compiled = bare(**UNCOUNTED)(lambda x: raised(x, 3) + doubled(x))  # never read from disk
    assert compiled(1.5) == 30.0
    assert {"raised", "doubled"} <= {name.split(".")[-1] for name in finished}
    (made,) = compiled.overloads.values()
    assert made.library.get_pointer_to_function(made.fndesc.llvm_cpython_wrapper_name) != 0


def test_a_whole_gives_what_its_parts_give():
    assert both(1.5, 3) == first.py_func(1.5, 3) - doubled(1.5) == 27.0


def test_a_whole_takes_parts_from_disk():
    """In another process each part is read: of it only code to be linked is kept. Nothing waits for linear algebra."""
    first.compile((types.float64, types.int64))
    done = subprocess.run([sys.executable, "-c", ANOTHER], cwd=ROOT, capture_output=True, text=True, timeout=100)
    assert done.stdout.split() == ["30.0", "1", "False"], done.stderr
