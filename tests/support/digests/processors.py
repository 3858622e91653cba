"""Processes that think they run on another processor."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[3]
BUILT: Any = np.show_config(mode="dicts")
SIMD = BUILT["SIMD Extensions"]  # of numpy beyond its least: those that the processor has, and the others
HAS = SIMD.get("found", [])
# Names that a library does not know are passed over: glibc called two of them otherwise before 2.33.
OLD = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,-FMA4,-AVX512F",
    "NPY_DISABLE_CPU_FEATURES": " ".join([*HAS, *SIMD.get("not found", [])]),
}
# OpenBLAS ends a process that is told a core type whose instructions the processor lacks.
WIDE = "SkylakeX" if "X86_V4" in HAS else "Zen" if "X86_V3" in HAS else "Prescott"
HASWELL = "Haswell" if "X86_V3" in HAS else "Nehalem"  # numpy itself needs what that one has
CHOICES = {"OPENBLAS_CORETYPE", "NUMBA_CPU_NAME", "NUMBA_DISABLE_JIT", *OLD}


def printed(module, arguments, choice):
    """Words printed by a module that runs as a program, its environment chosen and otherwise this one's."""
    kept = {key: value for key, value in os.environ.items() if key not in CHOICES}
    command = [sys.executable, "-m", module, *arguments]
    ran = subprocess.run(command, cwd=ROOT, env=kept | choice, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout.split()
