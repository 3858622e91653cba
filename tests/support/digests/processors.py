"""Processes that think they run on another processor."""

import os
import subprocess
import sys
from pathlib import Path

from numpy._core._multiarray_umath import __cpu_dispatch__ as numpy_dispatch

ROOT = Path(__file__).parents[3]
# Names that a library does not know are passed over: glibc called two of them otherwise before 2.33.
OLD = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,-FMA4,-AVX512F",
    "NPY_DISABLE_CPU_FEATURES": " ".join(numpy_dispatch),
}
CHOICES = {"OPENBLAS_CORETYPE", "NUMBA_CPU_NAME", "NUMBA_DISABLE_JIT", *OLD}


def printed(module, arguments, choice):
    """Words printed by a module that runs as a program, its environment chosen and otherwise this one's."""
    kept = {key: value for key, value in os.environ.items() if key not in CHOICES}
    command = [sys.executable, "-m", module, *arguments]
    ran = subprocess.run(command, cwd=ROOT, env=kept | choice, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout.split()
