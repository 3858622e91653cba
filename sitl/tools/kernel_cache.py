"""Cache folder of compiled kernels.

Numba's cache looks at the file of a function, but not at the files it calls into: after a change in one kernel, callers
in other files would go on with the old one. So the folder is named by a digest of all files with compiled functions.
"""

from __future__ import annotations

import hashlib
import os
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

from platformdirs import user_cache_path

PACKAGE = Path(__file__).parent.parent
COMPILED_FILES = (
    "compiled.py",
    "storage.py",
    "model/*.py",
    "enclosure/*.py",
    "control/*.py",
    "control/forward_flight/*.py",
    "sensors/*.py",
    "design/*.py",
    "estimation/*.py",
    "supervisor/*.py",
    "simulation/*.py",
    "prediction/*.py",
    "guidance/leg_speeds.py",  # constants of how waypoints are passed
    "guidance/legs.py",
    "guidance/view.py",
    "gym/action_kinds.py",
    "gym/fleet_step.py",
    "gym/rewards.py",
    "lab/studies/hover_region*.py",
    "lab/reproduction/equations/*.py",
    "lab/proofs/*.py",
    "lab/identification/replay.py",
    "vehicle/actuator_watch.py",
    "../protocol/dialect/darko.xml",
    "../protocol/ranges.py",
)


def use_source_keyed_cache() -> None:
    """Point numba's cache at the folder of these sources, within the folder that the user has set, if any."""
    name = f"kernels-{_digest()}"
    base = Path(os.environ.get("NUMBA_CACHE_DIR") or user_cache_path("darko"))
    folder = str(base if base.name == name else base / name)  # a child process inherits it as it is
    os.environ["NUMBA_CACHE_DIR"] = folder
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = folder


def is_complete() -> bool:
    """Whether everything is compiled already and a start only has to load it."""
    return _mark().exists()


def mark_complete() -> None:
    """Mark everything as compiled. If the mark cannot be written, the next start says that it compiles."""
    with suppress(OSError):
        _mark().touch()


def can_keep() -> bool:
    """Whether the cache can be written, so that other processes find what is compiled."""
    folder = Path(os.environ["NUMBA_CACHE_DIR"])
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    return os.access(folder, os.W_OK)


def _mark() -> Path:
    # Numba separates the kernels of copies of the package by the folder they lie in.
    place = hashlib.sha256(str(PACKAGE).encode()).hexdigest()[:16]
    return Path(os.environ["NUMBA_CACHE_DIR"]) / f"complete-{place}"


def sources() -> list[Path]:
    """The files of all that is compiled, and of the values and types that it uses."""
    root = PACKAGE
    return sorted(path.resolve() for pattern in COMPILED_FILES for path in root.glob(pattern))


@cache
def _digest() -> str:
    digest = hashlib.sha256()
    for path in sources():
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]
