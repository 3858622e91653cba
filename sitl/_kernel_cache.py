"""Where compiled kernels are kept.

Numba's cache looks at the file of a function, not at those it calls into: after a change in one kernel, callers in
other files would go on flying the old one. So the folder is named by the sources of all that is compiled.
"""

from __future__ import annotations

import hashlib
import os
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

from platformdirs import user_cache_path

COMPILED = (
    "compiled.py",
    "model/*.py",
    "control/*.py",
    "design/*.py",
    "estimation/*.py",
    "supervisor/*.py",
    "simulation/*.py",
    "prediction/*.py",
    "studies/**/*.py",
    "../protocol/dialect/darko.xml",
)


def use_source_keyed_cache() -> None:
    """Point numba's cache at the folder of these sources; a folder the user has set is left alone."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    folder = str(user_cache_path("darko") / f"kernels-{_digest()}")
    os.environ["NUMBA_CACHE_DIR"] = folder
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = folder


def is_complete() -> bool:
    """Whether everything was compiled before, so that starting is a matter of reading it."""
    return _mark().exists()


def mark_complete() -> None:
    """Everything is compiled and kept; where that cannot be written down, the next start says that it compiles."""
    with suppress(OSError):
        _mark().touch()


def _mark() -> Path:
    # Numba keeps the kernels of every copy of the package apart, by where it lies.
    place = hashlib.sha256(str(Path(__file__).parent).encode()).hexdigest()[:16]
    return Path(os.environ["NUMBA_CACHE_DIR"]) / f"complete-{_digest()}-{place}"


@cache
def _digest() -> str:
    root, digest = Path(__file__).parent, hashlib.sha256()
    for path in sorted(path for pattern in COMPILED for path in root.glob(pattern)):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]
