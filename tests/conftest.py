"""Property tests draw the same examples on every run; HYPOTHESIS_PROFILE=explore looks for new ones.

Files that fly nothing come first: beside them, kernels are compiled for the others.
"""

import os
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers

from tests.support import kernels

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("explore", deadline=None, print_blob=True)
PROFILE = os.environ.get("HYPOTHESIS_PROFILE", "repeatable")
settings.load_profile(PROFILE)

if PROFILE == "repeatable":
    # Hypothesis mixes in constants of the modules imported so far: a test's examples would depend on the tests before.
    providers._get_local_constants = providers.Constants

COMPILING = pytest.StashKey()


def pytest_configure(config):
    """The process that hands out files to the workers has the kernels compiled."""
    if getattr(config.option, "numprocesses", None):
        config.stash[COMPILING] = kernels.compile_aside()


def pytest_unconfigure(config):
    """Leave no process and no file behind."""
    process = config.stash.get(COMPILING, None)
    if process is not None:
        process.kill()
        process.wait()
        Path(os.environ.pop(kernels.LOCK)).unlink()


def pytest_collection_modifyitems(items):
    """Files that fly nothing first, each otherwise in its place."""
    items.sort(key=lambda item: kernels.flies(item.path))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Nobody compiles what is being compiled."""
    if kernels.flies(item.path):
        kernels.wait()
