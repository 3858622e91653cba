"""Mutation testing of a small project: what its tests hold is killed, what they do not survives."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = '''"""A small module."""

LIMIT = 3


def is_high(x: int) -> bool:
    """Held by a test at the limit and beside it."""
    return x > LIMIT


def unused(a: bool, b: bool) -> bool:
    """No test calls it."""
    return a and b


def held_in_part(x: int) -> tuple[int, int]:
    """The tests hold one half of it."""
    return -x, -x
'''
TESTS = """
import pytest
from toy import numbers

@pytest.fixture(scope="module")
def limit():
    return numbers.LIMIT

@pytest.mark.parametrize(("x", "high"), [(3, False), (4, True)])
def test_high(limit, x, high):
    assert limit == 3
    assert numbers.is_high(x) == high

def test_half():
    assert numbers.held_in_part(2)[1] == -2

def test_that_fails_anyway():
    assert numbers.unused(True, False)
"""
PROJECT = """
[tool.hatch.build]
artifacts = ["toy/generated.py"]
[tool.pytest.ini_options]
addopts = "--import-mode=importlib"
pythonpath = ["."]
"""


@pytest.fixture
def project(tmp_path):
    tree = tmp_path / "tree"
    (tree / "toy").mkdir(parents=True)
    (tree / "tests" / "toy").mkdir(parents=True)
    (tree / "toy" / "__init__.py").touch()
    (tree / "toy" / "numbers.py").write_text(SOURCE)
    (tree / "toy" / "generated.py").write_text("x = 1 < 2\n")
    (tree / "tests" / "toy" / "test_numbers.py").write_text(TESTS)
    (tree / "pyproject.toml").write_text(PROJECT)
    return tree


def mutate(tree, *options):
    command = [sys.executable, ROOT / "scripts" / "mutate.py", "--package", "toy", "--tree", tree, "--jobs", "1"]
    environment = os.environ | {
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",  # these tests need none, and start sooner
        "TMPDIR": str(tree.parent),
    }
    ended = subprocess.run([*command, *options], capture_output=True, text=True, timeout=120, env=environment)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


def test_the_same_seed_draws_the_same_mutants_and_generated_files_have_none(project):
    every = mutate(project, "--list").splitlines()
    assert "toy/numbers.py:8  x > LIMIT  ->  x >= LIMIT" in every
    assert not any("generated" in line for line in every)
    drawn = mutate(project, "--list", "--count", "2", "--seed", "7").splitlines()
    assert len(drawn) == 2
    assert set(drawn) < set(every)
    assert mutate(project, "--list", "--count", "2", "--seed", "7").splitlines() == drawn


@pytest.mark.long
def test_what_survives_is_what_no_test_holds(project, tmp_path):
    out = tmp_path / "out.json"
    printed = mutate(project, "--json", out)
    survivors = ["toy/numbers.py:13  a and b  ->  a or b  (0 tests)", "toy/numbers.py:18  -x  ->  x  (1 tests)"]
    assert "\n".join(["4 of 6 mutants killed (67 %)", *survivors]) in printed
    outcomes = ["killed"] * 3 + ["survived"] * 2 + ["killed"]
    assert [row["outcome"] for row in json.loads(out.read_text())] == outcomes
    assert "0 of 2 mutants killed" in mutate(project, "--again", out)
    assert (project / "toy" / "numbers.py").read_text() == SOURCE
