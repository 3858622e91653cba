"""Compiled kernels are kept by what they were compiled from."""

import shutil
import subprocess
import sys
from pathlib import Path

SITL = Path(__file__).parent.parent.parent / "sitl"


def cache_of(folder, **environment):
    """The cache folder that a copy of the package would use."""
    code = "import sitl, os; print(os.environ['NUMBA_CACHE_DIR'])"
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True)
    return done.stdout.strip()


def test_a_change_in_any_kernel_is_another_cache(tmp_path):
    shutil.copytree(SITL, tmp_path / "sitl", ignore=shutil.ignore_patterns("__pycache__"))
    before = cache_of(tmp_path, HOME=str(tmp_path))
    assert before == cache_of(tmp_path, HOME=str(tmp_path))
    kernel = tmp_path / "sitl" / "kernels" / "aerodynamics.py"
    kernel.write_text(kernel.read_text() + "\n")
    assert before != cache_of(tmp_path, HOME=str(tmp_path))


def test_a_folder_the_user_has_set_is_used(tmp_path):
    assert cache_of(SITL.parent, NUMBA_CACHE_DIR=str(tmp_path)) == str(tmp_path)
