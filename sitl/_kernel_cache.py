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
    """Point numba's cache at the folder of these sources, within the one that the user has set if there is one."""
    name = f"kernels-{_digest()}"
    base = Path(os.environ.get("NUMBA_CACHE_DIR") or user_cache_path("darko"))
    folder = str(base if base.name == name else base / name)  # a process inherits it as it is
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


def can_keep() -> bool:
    """Whether what is compiled can be kept, for other processes as well."""
    folder = Path(os.environ["NUMBA_CACHE_DIR"])
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    return os.access(folder, os.W_OK)


def _mark() -> Path:
    # Numba keeps the kernels of every copy of the package apart, by where it lies.
    place = hashlib.sha256(str(Path(__file__).parent).encode()).hexdigest()[:16]
    return Path(os.environ["NUMBA_CACHE_DIR"]) / f"complete-{place}"


def sources() -> list[Path]:
    """The files of all that is compiled, and of what it is made from."""
    root = Path(__file__).parent
    return sorted(path.resolve() for pattern in COMPILED for path in root.glob(pattern))


@cache
def _digest() -> str:
    digest = hashlib.sha256()
    for path in sources():
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]
