"""The cache of compiled kernels depends on all that they were compiled from."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import sitl
from sitl.compiled import entry
from sitl.tools import kernel_cache

ROOT = Path(__file__).parent.parent.parent.parent
SITL = ROOT / "sitl"
DECORATORS = {"kernel", "subroutine", "entry", "part", "unkept_entry", "njit"}

MARK = """
import sitl
from sitl.tools import kernel_cache as cache
print(cache.is_complete())
cache.can_keep()
cache.mark_complete()
print(cache.is_complete())
"""


def output(code, folder, **environment):
    """Words printed by a program that runs on the package of a folder."""
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True)
    return done.stdout.split()


def cache_of(folder, **environment):
    """The cache folder that a copy of the package would use."""
    (line,) = output("import sitl, os; print(os.environ['NUMBA_CACHE_DIR'])", folder, **environment)
    return line


@pytest.fixture
def copy(tmp_path):
    """A copy of the package."""
    shutil.copytree(SITL, tmp_path / "sitl", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "protocol" / "dialect").mkdir(parents=True)
    shutil.copy(ROOT / "protocol" / "dialect" / "darko.xml", tmp_path / "protocol" / "dialect")
    return tmp_path


@pytest.mark.long(after=1)
@pytest.mark.parametrize("changed", ["sitl/model/aerodynamics.py", "sitl/compiled.py", "protocol/dialect/darko.xml"])
def test_a_changed_kernel_gets_another_cache(copy, changed):
    before = cache_of(copy, HOME=str(copy))
    assert before == cache_of(copy, HOME=str(copy))
    (copy / changed).write_text((copy / changed).read_text() + "\n")
    assert before != cache_of(copy, HOME=str(copy))


def test_kernels_have_their_own_folder_in_the_one_the_user_has_set(tmp_path):
    folder = cache_of(ROOT, NUMBA_CACHE_DIR=str(tmp_path))
    assert Path(folder).parent == tmp_path
    assert cache_of(ROOT, NUMBA_CACHE_DIR=folder) == folder  # as a process inherits it


def test_a_first_start_leaves_a_mark_that_a_change_invalidates(copy):
    kept = copy / "kept"
    kept.mkdir()
    assert output(MARK, copy, NUMBA_CACHE_DIR=str(kept)) == ["False", "True"]
    assert output(MARK, copy, NUMBA_CACHE_DIR=str(kept)) == ["True", "True"]
    shutil.copytree(copy / "sitl", copy / "other" / "sitl")
    shutil.copytree(copy / "protocol", copy / "other" / "protocol")
    assert output(MARK, copy / "other", NUMBA_CACHE_DIR=str(kept)) == ["False", "True"]
    (copy / "sitl" / "simulation" / "more.py").write_text("\n")
    assert output(MARK, copy, NUMBA_CACHE_DIR=str(kept)) == ["False", "True"]


def test_a_folder_that_cannot_be_written_is_no_error(tmp_path):
    (tmp_path / "not").write_text("a folder")
    assert output(MARK, ROOT, NUMBA_CACHE_DIR=str(tmp_path / "not" / "there")) == ["False", "False"]


def test_kernels_are_compiled_even_if_they_cannot_be_kept():
    scope = {}
    exec("def of_no_file(x): return x + 1", scope)  # noqa: S102
    assert entry(scope["of_no_file"])(2) == 3


def compiled_functions(tree):
    """The functions of a module that are compiled."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            called = (d.func if isinstance(d, ast.Call) else d for d in node.decorator_list)
            if DECORATORS & {d.id for d in called if isinstance(d, ast.Name)}:
                yield node


def origins(tree):
    """The names a module imports from this project, and the files they come from."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith(("sitl", "protocol")):
            place = ROOT.joinpath(*node.module.split("."))
            file = place.with_suffix(".py")
            for alias in node.names:
                if node.module == "sitl" and alias.name in sitl._NAMES:  # the public API only passes names on
                    file = ROOT.joinpath(*sitl._NAMES[alias.name].split(".")).with_suffix(".py")
                yield alias.asname or alias.name, file if file.exists() else place / f"{alias.name}.py"


@pytest.mark.long
def test_the_cache_covers_every_compiled_function_and_all_it_uses():
    covered = {*kernel_cache.sources(), ROOT / "protocol" / "dialect" / "vocabulary.py"}  # made of darko.xml
    found = 0
    for path in SITL.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        functions = list(compiled_functions(tree))
        if not functions:
            continue
        found += len(functions)
        assert path in covered
        used = {n.id for function in functions for n in ast.walk(function) if isinstance(n, ast.Name)}
        assert {file for name, file in origins(tree) if name in used} <= covered, path
    assert found > 150
