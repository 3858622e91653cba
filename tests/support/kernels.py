"""Kernels are compiled once, by a process beside the tests, while those run that fly nothing.

Without it every worker of a first run would compile all of them. The process holds a lock for its life, however it
ends; a test that flies waits for the lock. Nothing of this happens in a run by a single process, or when the kernels
are there.
"""

import fcntl
import os
import re
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

from sitl._kernel_cache import is_complete

ROOT = Path(__file__).parents[2]
LOCK = "DARKO_TESTS_COMPILING"  # environment variable: the file that is locked meanwhile
COMPILE = """
from sitl.airframe import load
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft
from sitl.parameters import Bindings, Surroundings
from sitl.rehearsal import make_ready
from sitl.vehicle import Vehicle
from protocol.frames import Geodetic, LocalFrame

vehicle = Vehicle(load("nominal").parameters)
world = World(LocalFrame(Geodetic(43.5648, 1.4811, 150.0)), ARENAS["open"])
make_ready(Craft(vehicle, world, Bindings(Settings(), vehicle.tuning, Surroundings())), lambda text: None)
"""


def compile_aside():
    """Start compiling, unless it is done; the process, if there is one."""
    if is_complete():
        return None
    with tempfile.NamedTemporaryFile(prefix="darko-tests-", delete=False) as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        os.environ[LOCK] = lock.name
        return subprocess.Popen([sys.executable, "-c", COMPILE], cwd=ROOT, pass_fds=[lock.fileno()])


def wait():
    """Wait until the kernels are there, or nobody compiles them."""
    name = os.environ.pop(LOCK, None)
    if name is not None:
        with Path(name).open() as lock:  # a shared lock is had when the exclusive one is gone
            fcntl.flock(lock, fcntl.LOCK_SH)


@cache
def flies(path):
    """Whether a test file needs kernels: it names the vehicle, or another test file that does."""
    text = path.read_text(encoding="utf-8")
    if "e2e" in path.parts or re.search(r"\bsitl\b", text):
        return True
    return any(map(flies, _imported(text)))


def _imported(text):
    for package, names in re.findall(r"^from (tests[\w.]*) import ([^\n(]+)", text, re.MULTILINE):
        folder = ROOT.joinpath(*package.split("."))
        files = [folder.with_suffix(".py"), *(folder / f"{name.strip()}.py" for name in names.split(","))]
        yield from filter(Path.is_file, files)
