"""Gains do not depend on the processor: one hash over all gains, whatever loops the libraries choose."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__ as numpy_dispatch

ROOT = Path(__file__).parents[3]
OLD = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-FMA,-FMA4,-AVX512F",
    "NPY_DISABLE_CPU_FEATURES": " ".join(numpy_dispatch),
}
# A core type that the processor or the build of OpenBLAS does not have falls back to another.
PROCESSORS = [
    {"OPENBLAS_CORETYPE": "Haswell"},
    {"OPENBLAS_CORETYPE": "Prescott", "NUMBA_CPU_NAME": "generic", **OLD},
    {"OPENBLAS_CORETYPE": "SkylakeX", "NUMBA_DISABLE_JIT": "1"},
]


def digest(choice):
    """Count and hash of every number of every design, computed by a process that thinks it runs elsewhere."""
    kept = {key: value for key, value in os.environ.items() if key not in {"OPENBLAS_CORETYPE", *OLD}}
    command = [sys.executable, "-m", "tests.support.digests.gains_digest"]
    ran = subprocess.run(command, cwd=ROOT, env=kept | choice, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout.split()


@pytest.mark.long
def test_every_processor_designs_the_same_numbers():
    with ThreadPoolExecutor(2) as two:
        found = list(two.map(digest, PROCESSORS))
    assert int(found[0][0]) > 50_000
    assert all(one == found[0] for one in found)
