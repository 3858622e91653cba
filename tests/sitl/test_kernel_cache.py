"""Compiled kernels are kept by what they were compiled from."""

import shutil
import subprocess
import sys
from pathlib import Path

SITL = Path(__file__).parent.parent.parent / "sitl"


MARK = """
import sitl
from sitl import _kernel_cache as cache
print(cache.is_complete())
cache.mark_complete()
print(cache.is_complete())
"""


def output(code, folder, **environment):
    """What a program prints that runs on the package of a folder."""
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True)
    return done.stdout.split()


def cache_of(folder, **environment):
    """The cache folder that a copy of the package would use."""
    (line,) = output("import sitl, os; print(os.environ['NUMBA_CACHE_DIR'])", folder, **environment)
    return line


def test_a_change_in_any_kernel_is_another_cache(tmp_path):
    shutil.copytree(SITL, tmp_path / "sitl", ignore=shutil.ignore_patterns("__pycache__"))
    before = cache_of(tmp_path, HOME=str(tmp_path))
    assert before == cache_of(tmp_path, HOME=str(tmp_path))
    kernel = tmp_path / "sitl" / "kernels" / "aerodynamics.py"
    kernel.write_text(kernel.read_text() + "\n")
    assert before != cache_of(tmp_path, HOME=str(tmp_path))


def test_a_folder_the_user_has_set_is_used(tmp_path):
    assert cache_of(SITL.parent, NUMBA_CACHE_DIR=str(tmp_path)) == str(tmp_path)


def test_a_first_start_leaves_a_mark_that_a_change_makes_void(tmp_path):
    shutil.copytree(SITL, tmp_path / "sitl", ignore=shutil.ignore_patterns("__pycache__"))
    kept = tmp_path / "kept"
    kept.mkdir()
    assert output(MARK, tmp_path, NUMBA_CACHE_DIR=str(kept)) == ["False", "True"]
    assert output(MARK, tmp_path, NUMBA_CACHE_DIR=str(kept)) == ["True", "True"]
    shutil.copytree(tmp_path / "sitl", tmp_path / "other" / "sitl")
    assert output(MARK, tmp_path / "other", NUMBA_CACHE_DIR=str(kept)) == ["False", "True"]
    (tmp_path / "sitl" / "flow.py").write_text("\n")
    assert output(MARK, tmp_path, NUMBA_CACHE_DIR=str(kept)) == ["False", "True"]


def test_a_folder_that_cannot_be_written_is_no_error(tmp_path):
    assert output(MARK, SITL.parent, NUMBA_CACHE_DIR=str(tmp_path / "not" / "there")) == ["False", "False"]
