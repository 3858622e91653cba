"""Write a file so that it is there complete or not at all, also after a crash in between."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from protocol.errors import FileError

__all__ = ["write_atomically"]


def write_atomically(path: Path, data: bytes, *, mode: int = 0o666) -> None:
    """Write a file; an old one stays until the new one is complete and on the disk.

    Args:
        path: The file.
        data: Its whole content.
        mode: Its permissions, less the process's umask.

    Raises:
        FileError: The file cannot be written; nothing is left behind.
    """
    staged = path.with_name(f".{path.name}.new")
    try:
        staged.unlink(missing_ok=True)  # a leftover of a crash may have other permissions
        with os.fdopen(os.open(staged, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        staged.replace(path)
    except OSError as error:
        with suppress(OSError):
            staged.unlink(missing_ok=True)
        raise FileError(f"{path}: cannot be written: {error.strerror}") from error
