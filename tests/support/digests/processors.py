"""Processes that think they run on another processor."""

import os
import subprocess
import sys
from pathlib import Path

from numpy._core._multiarray_umath import __cpu_dispatch__ as numpy_dispatch
from numpy._core._multiarray_umath import __cpu_features__ as processor_has

ROOT = Path(__file__).parents[3]
# Names that a library does not know are passed over: glibc called two of them otherwise before 2.33.
OLD = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,-FMA4,-AVX512F",
    "NPY_DISABLE_CPU_FEATURES": " ".join(numpy_dispatch),
}
# OpenBLAS ends a process that is told a core type whose instructions the processor lacks.
WIDE = "SkylakeX" if processor_has["AVX512_SKX"] else "Zen" if processor_has["AVX2"] else "Prescott"
HASWELL = "Haswell" if processor_has["AVX2"] else "Nehalem" if processor_has["SSE42"] else "Prescott"
CHOICES = {"OPENBLAS_CORETYPE", "NUMBA_CPU_NAME", "NUMBA_DISABLE_JIT", *OLD}


def printed(module, arguments, choice):
    """Words printed by a module that runs as a program, its environment chosen and otherwise this one's."""
    kept = {key: value for key, value in os.environ.items() if key not in CHOICES}
    command = [sys.executable, "-m", module, *arguments]
    ran = subprocess.run(command, cwd=ROOT, env=kept | choice, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout.split()
